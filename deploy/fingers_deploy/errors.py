"""The errors of this package: input that is refused, in one sentence."""


class InputError(ValueError):
    """A file, an argument or a device is refused, in one sentence.

    Args:
        source: the file or argument in which the value stands.
        field: the field inside `source`, dotted; empty when the source as a whole is
            at fault.
        found: what was found there.
        valid: what would have been valid.
    """

    def __init__(self, source: object, field: str, found: object, valid: str):
        self.source, self.field, self.found, self.valid = source, field, found, valid
        where = f"{source}: {field}" if field else f"{source}"
        super().__init__(f"{where}: found {_short(found)}; valid: {valid}")


class BundleError(InputError):
    """A policy bundle that cannot be honoured."""


def _short(value: object, limit: int = 120) -> str:
    """Returns `value` on one line, shortened to `limit` characters."""
    text = " ".join(str(value).split()) or "nothing"
    return text if len(text) <= limit else text[: limit - 1] + "…"
