"""How processes share a section: each sample comes once, in batches that depend only on the stretches."""

from itertools import chain

from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.database.order import own_part, stretches_of_section


def batches(total: int, batch: int, count: int, own: range) -> list[list[int]]:
    """The samples that the stretches `own` have of each batch."""
    parts = [stretches_of_section(total, batch, count)[number] for number in own]
    return [
        list(chain(*(samples[turn * places : (turn + 1) * places] for samples, places in parts)))
        for turn in range(-(-total // batch))
    ]


@given(st.integers(1, 300), st.integers(1, 40), st.integers(1, 5), st.integers(1, 4))
@settings(max_examples=100, deadline=None)
def test_processes_read_the_parts_of_the_batches_of_one(
    total: int, batch: int, each: int, processes: int
) -> None:
    count = each * processes
    batch = max(batch, count)
    whole = batches(total, batch, count, range(count))
    assert sorted(chain(*whole)) == list(range(total))
    assert {len(found) for found in whole[:-1]} <= {batch}
    shared = [batches(total, batch, count, own_part(count, rank, processes)) for rank in range(processes)]
    assert [list(chain(*parts)) for parts in zip(*shared, strict=True)] == whole
    for rank, own in enumerate(shared):
        places = own_part(batch, rank, processes)
        assert all(
            found == of_all[places.start : places.stop]
            for found, of_all in zip(own[:-1], whole, strict=False)
        )
