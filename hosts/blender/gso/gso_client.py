"""Client of ``gso serve --stdio``, for programs with a Python of their own (3.9 or newer).

``docs/hosts.rst`` describes the protocol. ``python hosts/copy_client.py`` copies this file into the
folders of the hosts.

    with Client() as gso:
        result = gso.call("unfold", mesh={"vertices": points, "faces": faces}, output="net.dxf")
"""

import json
import math
import os
import shlex
import shutil
import subprocess
import tempfile

#: Environment variable with the command that starts gso.
VARIABLE = "GSO_COMMAND"
#: Distance from a straight line, relative to the size, up to which points are on it.
STRAIGHT = 1e-7


class GsoError(Exception):
    """A request failed; the message says why and what to do.

    Attributes
    ----------
    kind : str
        Class of the error, such as "MeshError" or "Cancelled".
    """

    def __init__(self, message, kind=""):
        super().__init__(message)
        self.kind = kind


def command_of(given=None):
    """Return the command that starts gso, as a list.

    Parameters
    ----------
    given : str or list of str, optional
        The program's path, or a command with arguments; by default the environment variable
        GSO_COMMAND, or ``gso``.

    Raises
    ------
    GsoError
        There is no such program.
    """
    given = given or os.environ.get(VARIABLE) or "gso"
    if isinstance(given, str):
        # A path may have spaces.
        given = [given] if shutil.which(given) else shlex.split(given, posix=os.name != "nt")
    if shutil.which(given[0]) is None:
        raise GsoError(
            "{} is not found; install gso (pip install gso), and give the path of its command, "
            "or set the environment variable {}".format(given[0], VARIABLE)
        )
    return list(given)


class Client:
    """A running server.

    Parameters
    ----------
    command : str or list of str, optional
        See :func:`command_of`.
    """

    def __init__(self, command=None):
        # The Python of the host must not be that of gso.
        away = ("PYTHONHOME", "PYTHONPATH")
        environment = {k: v for k, v in os.environ.items() if k not in away}
        command = command_of(command)
        self._count = 0
        self._log = tempfile.TemporaryFile()  # noqa: SIM115
        try:
            self._process = subprocess.Popen(
                [*command, "serve", "--stdio"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._log,
                env=environment,
                # No window on Windows.
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
        except OSError as error:
            self._log.close()
            raise GsoError("{} cannot be started: {}".format(command[0], error)) from None

    def call(self, method, progress=None, **params):
        """Send a request, and return its result.

        Parameters
        ----------
        method : str
        progress : callable, optional
            Called with the share that is done, None if it is not known, and a text. The request is
            cancelled if it returns False.
        **params
            Those that are None are left out.

        Raises
        ------
        GsoError
            The request failed or was cancelled, or the server has ended.
        """
        number = self._send(method, {k: v for k, v in params.items() if v is not None})
        while True:
            answer = self._receive()
            if answer.get("id") != number:
                continue
            if "error" in answer:
                raise GsoError(answer["error"]["message"], answer["error"].get("kind", ""))
            if "result" in answer:
                return answer["result"]
            if progress is not None and progress(answer["progress"], answer["text"]) is False:
                self._send("cancel", {"id": number})

    def close(self):
        """End the server."""
        if self._process.poll() is None:
            self._process.stdin.close()
            try:
                self._process.wait(5)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._process.stdout.close()
        self._log.close()

    def __enter__(self):
        return self

    def __exit__(self, *raised):
        self.close()

    def _send(self, method, params):
        """Send a request, and return its id."""
        self._count += 1
        request = {"id": self._count, "method": method, "params": params}
        try:
            self._process.stdin.write(json.dumps(request).encode() + b"\n")
            self._process.stdin.flush()
        except (OSError, ValueError):
            raise self._ended() from None
        return self._count

    def _receive(self):
        line = self._process.stdout.readline()
        if not line:
            raise self._ended()
        return json.loads(line)

    def _ended(self):
        """Return the error of a server that has ended, with the last line of its log."""
        self._log.seek(0)
        said = self._log.read().decode(errors="replace").strip().splitlines()
        why = ": " + said[-1] if said else ""
        return GsoError("gso has ended" + why)


def corners_of(polygon):
    """Return a closed polygon without the points that are on the line through their neighbours."""
    size = max(max(p) - min(p) for p in zip(*polygon))
    kept = list(polygon)
    k = 0
    while k < len(kept) > 3:
        (ax, ay), (bx, by), (cx, cy) = kept[k - 1], kept[k], kept[(k + 1) % len(kept)]
        long = math.hypot(cx - ax, cy - ay)
        off = abs((cx - ax) * (by - ay) - (cy - ay) * (bx - ax)) / long if long else size
        ahead = (bx - ax) * (cx - bx) + (by - ay) * (cy - by) > 0
        if ahead and off <= STRAIGHT * size:
            del kept[k]
        else:
            k += 1
    return kept


def lines_of(part):
    """Return what is drawn of a part: (kind, points, whether they are closed).

    Kinds are "cut", "mountain" and "valley" (lines to bend along), and "crease".
    """
    out = [("cut", corners_of(ring), True) for ring in [part["outline"], *part["holes"]]]
    for bend in part["bends"]:
        out.append(("mountain" if bend["angle"] > 0 else "valley", bend["line"], False))
    return out + [("crease", line, False) for line in part["creases"]]


def why_not(result):
    """Return the reasons against a result as texts; empty if it is usable."""
    return [reason["text"] for reason in result.get("reasons", [])]
