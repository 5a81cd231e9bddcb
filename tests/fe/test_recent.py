"""Only the owners looked at last keep what they computed."""

from __future__ import annotations

from dataclasses import dataclass, field

from cvxupdate.fe.recent import HELD, Once, recent


@dataclass(frozen=True)
class Owner:
    """Counts how often it computes."""

    number: int
    asked: list[int] = field(default_factory=list)

    @recent
    def value(self) -> int:
        """Its square."""
        self.asked.append(self.number)
        return self.number**2


def test_the_owners_looked_at_last_keep_theirs():
    owners = [Owner(k) for k in range(HELD + 1)]
    assert [o.value for o in owners[:HELD]] == [k * k for k in range(HELD)]
    assert owners[0].value == 0  # now owner 1 is the one looked at longest ago
    assert owners[HELD].value == HELD**2
    assert all(o.asked == [o.number] for o in owners)
    assert owners[0].value == 0
    assert owners[0].asked == [0]
    assert owners[1].value == 1
    assert owners[1].asked == [1, 1]


def test_owners_that_are_gone_do_no_harm():
    """Not even where another one has the same place in memory."""
    assert [Owner(k).value for k in range(50 * HELD)] == [k * k for k in range(50 * HELD)]
    one = Owner(3)
    assert one.value == 9
    del one
    assert not Owner.value._held


def test_it_says_what_it_is():
    assert Owner.value.__doc__ == "Its square."


def test_figures_are_kept_as_long_as_their_object_lives():
    asked = []

    def square(owner: Owner) -> int:
        asked.append(owner.number)
        return owner.number**2

    once = Once(square)
    owners = [Owner(k) for k in range(2 * HELD)]
    assert [once(o) for o in (*owners, *owners)] == [o.number**2 for o in (*owners, *owners)]
    assert asked == list(range(2 * HELD))
    again = Owner(3)  # equal, and another
    assert once(again) == 9 and asked[-1] == 3 and len(asked) == 2 * HELD + 1
    del owners
    assert len(once._held) == 1
