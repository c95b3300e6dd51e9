"""The worst case of an interrupt by path: the longest way through its instructions, whatever was seen to run.

A backward branch is taken at most as often as it ever was in one interrupt (image_port's costs); what it goes back over
is counted at its longest each time. So the sum is an upper bound for all ways that the runs may not have gone, not for
loops that could run longer than they ever did. Read-after-write stalls and reads of constants are counted.
"""

from functools import cache

import translate
from translate import REPEATS, Translator


def leaves(operation, index: int) -> bool:
    """Does the program never go on behind this instruction? A repetition leads to itself."""
    if operation.opcode.name == "BRANCH":
        return operation.inputs[0].space.name == "rom" and operation.inputs[0].offset // 4 != index
    return operation.opcode.name in ("BRANCHIND", "RETURN")


class PathError(ValueError):
    """One line: what of the program no path is known of."""


class Step:
    """An instruction: its cycles, where it leads (word, cycles more), what it calls."""

    def __init__(self, index: int, listing, operations, extra: bool, table: list[int]):
        self.mnemonic, self.length = listing.mnem, listing.length // 4
        special = translate.special_of(self.mnemonic)
        self.cycles = translate.LONG.get(self.mnemonic, 2 if self.mnemonic.startswith("tbl") else 1) + extra
        self.written, self.pointers = translate.registers_of(operations)
        self.calls, self.next = [], []
        self.repeats = int(listing.body.lstrip("#"), 0) if special == REPEATS else 0
        after = index + self.length
        for operation in operations:
            place = operation.inputs[0] if operation.inputs else None
            name = operation.opcode.name
            if name == "CALLIND":
                raise PathError(f"{2 * index:#x}: calls what is only known while it runs")
            if name == "BRANCHIND" and self.mnemonic != "reset":
                self.next += [(to, 1) for to in table]
            if name == "CALL":
                self.calls.append(place.offset // 4)
            elif name in ("BRANCH", "CBRANCH") and place.space.name == "rom" and place.offset // 4 != index:
                self.next.append((place.offset // 4, 1 if self.mnemonic == "bra" else 0))
        if not any(leaves(o, index) for o in operations):
            self.next.append((after, 0))


class Program:
    """The instructions of an image. `loops`: words -> times; `constants`: words that read flash as data."""

    def __init__(self, words: dict[int, int], loops: dict[int, int], constants: set[int]):
        translator = Translator(words)
        self.steps, self.loops = {}, loops
        for index in sorted(words):
            found = translator.sleigh(index)
            if found is not None:
                self.steps[index] = (*found, index in constants)
        self.worst = cache(self._worst)

    @cache  # noqa: B019  (a program lives as long as its figures are wanted)
    def step(self, index: int) -> Step:
        return Step(index, *self.steps[index], self.branches(index + 1))

    def branches(self, index: int) -> list[int]:
        """The words of a table of branches, which a computed one leads into."""
        out = []
        while index in self.steps and self.steps[index][0].mnem == "bra" and "," not in self.steps[index][0].body:
            out.append(index)
            index += 1
        return out

    def function(self, entry: int) -> tuple[list[int], set[tuple[int, int]]]:
        """Words reached from `entry` without its calls, each before those that follow it, and the branches that loop.

        A branch loops if it goes back and its end leads to it again; without these the rest has an order."""
        leads = {entry: self.successors(entry)}
        waiting = list(leads[entry])
        while waiting:
            index = waiting.pop()
            if index not in leads:
                leads[index] = self.successors(index)
                waiting += leads[index]
        loops = {(at, to) for at in leads for to in leads[at] if to <= at and self.reaches(leads, to, at)}
        order: list[int] = []
        self.visit(leads, loops, entry, set(), order)
        return order[::-1], loops

    def successors(self, index: int) -> list[int]:
        return [to for to, _ in self.step(index).next]

    @staticmethod
    def reaches(leads: dict[int, list[int]], start: int, end: int) -> bool:
        seen, waiting = set(), [start]
        while waiting:
            index = waiting.pop()
            if index not in seen:
                seen.add(index)
                waiting += leads[index]
        return end in seen

    def visit(self, leads, loops, index: int, seen: set[int], order: list[int]) -> None:
        seen.add(index)
        for to in leads[index]:
            if to not in seen and (index, to) not in loops:
                self.visit(leads, loops, to, seen, order)
        order.append(index)

    def cost(self, index: int, before: Step | None) -> int:
        step = self.step(index)
        stall = 1 if before is not None and before.written & step.pointers else 0
        times = before.repeats + 1 if before is not None and before.repeats else 1
        return (step.cycles + stall) * times + sum(self.worst(to) for to in step.calls)

    def longest(self, order: list[int], loops: set[tuple[int, int]], start: int) -> dict[int, int]:
        """Most cycles from `start` to the end of each word of a function that follows it, without going round."""
        most = {start: self.cost(start, None)}
        for index in order:
            if index not in most:
                continue
            step = self.step(index)
            for to, more in step.next:
                if (index, to) not in loops:
                    most[to] = max(most.get(to, 0), most[index] + more + self.cost(to, step))
        return most

    def _worst(self, entry: int) -> int:
        order, loops = self.function(entry)
        total = max(self.longest(order, loops, entry).values())
        for at, to in loops:
            around = self.longest(order, loops, to).get(at)
            if around is None:
                raise PathError(f"{2 * at:#x}: a loop that is not entered at its head")
            total += self.loops.get(at, 0) * (around + 2)  # the branch taken, and a stall
        return total


def handlers(words: dict[int, int], irqs: dict[str, int]) -> dict[str, int]:
    """First word of each interrupt's handler in the application, through vector table and jump table."""
    out = {}
    for name, irq in irqs.items():
        jump = words[(0x14 + 2 * irq) // 2] // 2
        found = Translator(words).sleigh(jump)
        out[name] = found[1][-1].inputs[0].offset // 4
    return out
