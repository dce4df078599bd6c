"""A session that waits for its router, and says once each time that it came or went."""

from collections.abc import Callable
import threading
from typing import Any, Protocol, TYPE_CHECKING

from .errors import FleetError
from .session import endpoints_of, needs_zenoh, open_session

if TYPE_CHECKING:
    import zenoh

# How long one try to connect takes, and so at most the end of a link that never came up.
_TRY_S = 1.0


class Logger(Protocol):
    """Where lines go: a logger of rclpy's, or of Python's ``logging``."""

    def info(self, message: str, /) -> object:
        """Write that all is well."""

    def warning(self, message: str, /) -> object:
        """Write that something is not."""


class Link:
    """
    Opens a session in a thread of its own, as soon as there is a router to connect to.

    From then on Zenoh connects again by itself whenever the router went.
    """

    def __init__(self, config: 'zenoh.Config', opened: Callable[['zenoh.Session'], object],
                 logger: Logger) -> None:
        """
        Begin to connect.

        :param config: see ``configuration``.
        :param opened: gets the session once, when it is connected, in the link's thread.
        :param logger: gets a line when the router came, went, or is not there at first.
        :raises FleetError: Zenoh is not installed.
        """
        self._zenoh = needs_zenoh()
        self._config = config
        self._opened = opened
        self._logger = logger
        self._routers = ', '.join(endpoints_of(config))
        self._closed = threading.Event()
        self._session: Any = None
        self._thread = threading.Thread(target=self._open, name='fleet link', daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the session; within a second or so where it never began."""
        self._closed.set()
        self._thread.join()
        if self._session is not None:
            self._session.close()

    def _open(self) -> None:
        complained = False
        while not self._closed.is_set():
            try:
                self._session = open_session(self._config, _TRY_S)
            except FleetError as error:
                if not complained:
                    self._logger.warning(f'no connection to {self._routers} yet, and trying on: '
                                         f'{error} (RUST_LOG=zenoh=info tells why)')
                complained = True
            else:
                self._opened(self._session)
                self._listener = self._session.info.declare_transport_events_listener(
                    self._changed, history=True)
                return

    def _changed(self, event: 'zenoh.TransportEvent') -> None:
        if self._closed.is_set():
            return
        if event.kind == self._zenoh.SampleKind.PUT:
            self._logger.info(f'connected to {self._routers}')
        else:
            self._logger.warning(f'lost the connection to {self._routers}, and trying on')
