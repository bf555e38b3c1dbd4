# SPDX-License-Identifier: Apache-2.0
"""A proxy between a client and several daemons, of which a test says where it leads. Thread-safe."""
import socket
import threading


class Switchboard:
    """Listens on a Unix socket and leads to a daemon's."""

    def __init__(self, path, daemon):
        self.address = f"unix:{path}"
        self._lock = threading.Lock()
        self._to = daemon
        self._losing = threading.Event()
        self._open = []  # sockets, both ends of each connection
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(str(path))
        self._listener.listen(64)
        threading.Thread(target=self._accept, daemon=True).start()

    def lead_to(self, daemon):
        """Cuts all connections. New ones lead to this daemon, and its answers arrive."""
        with self._lock:
            self._to = daemon
            self._cut()
            self._losing.clear()

    def lose_answers(self):
        """Requests arrive at the daemon from now on, but none of its answers at the client."""
        self._losing.set()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._listener.close()
        with self._lock:
            self._cut()

    def _cut(self):
        for each in self._open:
            try:
                each.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass  # it is closed already
        self._open.clear()

    def _accept(self):
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            daemon = socket.socket(socket.AF_UNIX)
            with self._lock:
                try:
                    daemon.connect(self._to.address.removeprefix("unix:"))
                except OSError:
                    client.close()
                    continue
                self._open += [client, daemon]
            for pair in ((client, daemon, False), (daemon, client, True)):
                threading.Thread(target=self._forward, args=pair, daemon=True).start()

    def _forward(self, source, to, answers):
        try:
            while block := source.recv(1 << 16):
                if not (answers and self._losing.is_set()):
                    to.sendall(block)
        except OSError:
            pass
        for each in (source, to):
            try:
                each.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass
