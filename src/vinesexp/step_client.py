"""Have a step done by the process that has everything loaded, or else by a new one.

Started as a file by a Python without site packages, since it starts once for each step: nothing of
the package is imported here. The step writes to this process's own output; its exit code is ours.
"""

import os
import sys

#: Name of the environment variable that holds the socket of `vinesexp.step_server`.
SOCKET = "VINESEXP_STEP_SERVER"


def main() -> int:
    """Ask the server; where there is none, become the step."""
    place = os.environ.get(SOCKET)
    if place:
        code = ask(place, sys.argv[1])
        if code is not None:
            return code
    os.execv(sys.executable, [sys.executable, "-m", "vinesexp.record_job", sys.argv[1]])


def ask(place: str, job: str) -> int | None:
    """Exit code of a step that the server does; None where no server takes it.

    A step that dies without a word, killed by the system, ends with 137 as a shell would have it.
    """
    import socket

    with socket.socket(socket.AF_UNIX) as server:
        try:
            server.connect(place)
        except OSError:
            return None
        text = f"{os.getcwd()}\0{job}".encode(errors="surrogateescape")
        try:
            socket.send_fds(server, [len(text).to_bytes(8, "big")], [1, 2])
            server.sendall(text)
            accepted = server.recv(1)
        except OSError:
            accepted = b""
        if not accepted:
            return None  # the server ended before it began the step
        code = server.recv(1)
        return code[0] if code else 137


if __name__ == "__main__":
    sys.exit(main())
