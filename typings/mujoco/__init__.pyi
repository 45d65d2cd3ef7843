# MuJoCo's bindings are compiled and ship without stubs: every name is Any.
from typing import Any

def __getattr__(name: str) -> Any: ...
