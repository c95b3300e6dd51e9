"""Any process of a paced robot is killed or stopped: the wheels stop, the others come back, nobody is left over.

`python -m drills.pairs` does all of it; how soon the wheels stand is for it to judge.
"""

import time

import pytest
from drills.pairs import KILL, STOP, Campaign

SEED, PATIENCE_S = 3, 600.0
HITS = (
    (("whiskerd", STOP),),
    (("supervisor", STOP),),
    (("guard", STOP), ("driver", STOP)),
    (("guard", KILL), ("driver", STOP)),
    (("pilot", STOP), ("supervisor", KILL)),
)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    campaign = Campaign(tmp_path_factory.mktemp("pairs"), SEED, say=lambda text: None)
    campaign.run(dict(enumerate(HITS)), time.monotonic() + PATIENCE_S)
    return {result["number"]: result for result in campaign.results}


@pytest.mark.parametrize("number", range(len(HITS)), ids=[str(hits) for hits in HITS])
def test_the_wheels_stop_and_nobody_is_left_over(results, number):
    result = results[number]
    assert result["stop_s"] is not None, result
    assert [text for text in result["wrong"] if not text.startswith("wheels stopped after")] == []
