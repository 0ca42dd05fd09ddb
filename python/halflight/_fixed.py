"""Objects that never change: to set an attribute raises, and says how to get another object."""

from __future__ import annotations

from typing import Any, ClassVar

__all__ = ["Fixed", "refused"]


class Fixed:
    """What is set while an object is made stays; afterwards nothing can be set or deleted."""

    #: What to do in place of setting an attribute.
    _instead: ClassVar[str] = ""

    def _fix(self) -> None:
        """Ends the making of the object."""
        self.__dict__["_is_fixed"] = True

    def __setattr__(self, name: str, value: Any) -> None:
        if "_is_fixed" in self.__dict__:
            raise refused(self, name, self._instead)
        super().__setattr__(name, value)

    def __delattr__(self, name: str) -> None:
        raise refused(self, name, self._instead)


def refused(owner: object, name: str, instead: str) -> AttributeError:
    """The error for an attribute that cannot be set."""
    kind = type(owner).__name__
    return AttributeError(f"{name!r} cannot be set: a halflight.{kind} never changes; {instead}")
