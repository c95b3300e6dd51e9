"""How sure a share is that was counted."""

import math

Z_95 = 1.96


def wilson(counted: int, tried: int) -> tuple[float, float]:
    """95 % interval of a share, by Wilson's score (E. B. Wilson, JASA 22, 1927)."""
    share, spread = counted / tried, Z_95**2 / tried
    middle = share + spread / 2
    half = Z_95 * math.sqrt(share * (1 - share) / tried + spread / (4 * tried))
    return (middle - half) / (1 + spread), (middle + half) / (1 + spread)
