"""What is simulated beside other work is known to both afterwards."""

import numpy as np

from sysid.diagnosis.simulated.known import Known


def test_what_grows_apart_is_joined():
    first, second, third = np.zeros(1), np.ones(1), np.full(1, 2.0)
    known = Known({(("play",), False): {b"a": first}}, {b"p": first})
    apart = known.apart(), known.apart()
    apart[0].angles[("play",), False][b"b"] = second
    apart[1].angles[("play",), False][b"b"] = third
    apart[1].angles[((), True)] = {b"c": third}
    apart[1].targets[b"q"] = second
    assert [*known.angles] == [(("play",), False)] and [*known.targets] == [b"p"]
    known.join(apart)
    assert known.angles[("play",), False] == {b"a": first, b"b": second}
    assert known.angles[(), True] == {b"c": third}
    assert known.targets == {b"p": first, b"q": second}
