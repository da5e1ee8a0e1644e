"""Lines of the protocol: requests are read and checked, answers are written."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TypeGuard

from gso.errors import OptionError
from gso.spelling import check_keywords
from gso.typing import Json

#: Version of the protocol; it changes when a client of an earlier one would misread an answer.
PROTOCOL = 1
_FIELDS = ("id", "method", "params")


class LineError(OptionError):
    """A line is no request.

    Attributes
    ----------
    line : int
        Its number, from 1 on.
    id : str, int or None
        The id in it, where it has one.
    """

    def __init__(self, line: int, what: str, id: str | int | None = None):
        super().__init__(f"line {line} {what}")
        self.line, self.id = line, id


@dataclass(frozen=True)
class Request:
    """One request.

    Attributes
    ----------
    id : str or int
        Name of the request, which its answer has too.
    method : str
    params : dict
    """

    id: str | int
    method: str
    params: Json


def is_id(value: object) -> TypeGuard[str | int]:
    """Tell whether a value can be the id of a request.

    >>> is_id("a"), is_id(7), is_id(True), is_id([7])
    (True, True, False, False)
    """
    return isinstance(value, str | int) and not isinstance(value, bool)


def read_request(line: str | bytes, number: int) -> Request:
    """Read a line.

    Raises
    ------
    LineError
        It is no request. The message names the line and says what to send.

    Examples
    --------
    >>> read_request('{"id": 1, "method": "info", "params": {"mesh": "panel.obj"}}', 1)
    Request(id=1, method='info', params={'mesh': 'panel.obj'})
    >>> read_request("unfold panel.obj", 2)
    Traceback (most recent call last):
    gso.serving.protocol.LineError: line 2 is no JSON: Expecting value at column 1; send one object
    such as {"id": 1, "method": "info", "params": {"mesh": "panel.obj"}} in each line
    """
    example = '{"id": 1, "method": "info", "params": {"mesh": "panel.obj"}}'
    advice = f"send one object such as {example} in each line"
    try:
        given = json.loads(line)
    except json.JSONDecodeError as error:
        what = f"is no JSON: {error.msg} at column {error.colno}; {advice}"
        raise LineError(number, what) from None
    except (ValueError, RecursionError) as error:
        raise LineError(number, f"is no JSON: {error}; {advice}") from None
    if not isinstance(given, dict):
        raise LineError(number, f"is no JSON object; {advice}")
    id = given.get("id")
    if not is_id(id):
        raise LineError(number, 'has no "id"; give each request a text or a whole number')
    method, params = given.get("method"), given.get("params", {})
    try:
        check_keywords("a request", given, _FIELDS)
    except OptionError as error:
        raise LineError(number, f"is no request: {error}", id) from None
    if not isinstance(method, str):
        raise LineError(number, 'has no "method"; name one, such as "unfold"', id)
    if not isinstance(params, dict):
        raise LineError(number, 'has "params" that are no object; give names and values', id)
    return Request(id, method, params)


def encoded(answer: Json) -> str:
    r"""Return an answer as a line, with its end.

    >>> encoded({"id": 1, "result": {"usable": True}})
    '{"id":1,"result":{"usable":true}}\n'
    """
    return json.dumps(answer, separators=(",", ":"), ensure_ascii=False, allow_nan=False) + "\n"
