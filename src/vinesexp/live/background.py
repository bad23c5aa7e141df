"""Work in a process of its own, one piece at a time, that gives way to everything else."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any, Generic, TypeVar

from vinesexp.errors import VinesexpError
from vinesexp.threads import one_thread_each

T = TypeVar("T")
_NICE = 10  # behind the analysis of the newest record


class Background(Generic[T]):
    """A function that is called in another process.

    The process is started with the first piece of work and kept, so that what a library compiles
    or reads is done once. One that died is started again with the next piece.

    Parameters
    ----------
    work : callable
        Of a module, so that the other process finds it.

    Attributes
    ----------
    busy : bool
        Whether a piece of work was begun and not taken.
    seconds : float
        Of the processor, that the last piece took.

    Examples
    --------
    ::

        square = Background(math.sqrt)
        square.begin(2.0)
        while not square.done: ...
        square.take()
    """

    def __init__(self, work: Callable[..., T]) -> None:
        self._work = work
        self._process: multiprocessing.process.BaseProcess | None = None
        self._connection: Connection | None = None
        self.busy = False
        self.seconds = 0.0

    def begin(self, *arguments: Any) -> None:
        """Start a piece of work; the one before has been taken."""
        if self._process is None or not self._process.is_alive():
            self.stop()
            one_thread_each()
            context = multiprocessing.get_context("spawn")
            self._connection, other = context.Pipe()
            self._process = context.Process(target=_serve, args=(other, self._work), daemon=True)
            self._process.start()
            other.close()
        assert self._connection is not None
        self._connection.send(arguments)
        self.busy = True

    @property
    def done(self) -> bool:
        """Whether there is something to take."""
        return self.busy and self._connection is not None and self._connection.poll()

    def take(self) -> T:
        """What came out; waits for it.

        Raises
        ------
        VinesexpError
            The work failed, or its process ended; why, in one line.
        """
        assert self._connection is not None
        self.busy = False
        try:
            failed, answer, self.seconds = self._connection.recv()
        except (EOFError, OSError):
            self.stop()
            raise VinesexpError("its process ended; it starts again with the next record") from None
        if failed:
            raise VinesexpError(failed)
        found: T = answer
        return found

    def stop(self) -> None:
        """End the process, and the work that is under way with it."""
        if self._process is not None:
            self._process.terminate()
            self._process.join()
        if self._connection is not None:
            self._connection.close()
        self._process = self._connection = None
        self.busy = False


def _serve(connection: Connection, work: Callable[..., Any]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the program that started this
    if hasattr(os, "nice"):
        os.nice(_NICE)
    while True:
        try:
            arguments = connection.recv()
        except EOFError:
            return
        begun, failed, answer = time.process_time(), "", None
        try:
            answer = work(*arguments)
        except Exception as error:
            failed = " ".join(str(error).split()) or type(error).__name__
        try:
            connection.send((failed, answer, time.process_time() - begun))
        except OSError:
            return
