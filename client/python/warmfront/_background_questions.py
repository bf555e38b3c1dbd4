# SPDX-License-Identifier: Apache-2.0
"""The same questions as futures and for asyncio. Thread-safe, as `Session` says."""
from __future__ import annotations

import asyncio
from concurrent.futures import Future
from typing import Any

from ._background import Background
from ._backend import Backend
from ._questions import Questions
from .answer import Committed, Contacts, Intersections, MaxStep, VertexDistances


class BackgroundQuestions(Questions):
    """`submit_step()`, `step_async()` and their like. Arrays that are given have to stay as they are until the answer is
    there."""

    def __init__(self, backend: Backend) -> None:
        """Internal: use `Client.session()`, `Collider` or `open()`."""
        super().__init__(backend)
        self._background = Background()

    def submit_step(self, positions: Any = ..., **arguments: Any) -> Future[Contacts]:
        """`step()` as a future. What is submitted this way is carried out in its order, one after the other, on a thread of
        the session's own; calls of the session that wait meanwhile have their turn in between. A call that has begun goes on
        when its future is cancelled: give a timeout."""
        return self._background.submit(self.step, positions, **arguments)

    def submit_place(self, positions: Any = ..., **arguments: Any) -> Future[None]:
        """`place()` as a future, see `submit_step()`."""
        return self._background.submit(self.place, positions, **arguments)

    def submit_trial(self, positions: Any = ..., **arguments: Any) -> Future[Contacts]:
        """`trial()` as a future, see `submit_step()`."""
        return self._background.submit(self.trial, positions, **arguments)

    def submit_max_step(self, positions: Any = ..., **arguments: Any) -> Future[MaxStep]:
        """`max_step()` as a future, see `submit_step()`."""
        return self._background.submit(self.max_step, positions, **arguments)

    def submit_proximity(self, distance: float, **arguments: Any) -> Future[Contacts]:
        """`proximity()` as a future, see `submit_step()`."""
        return self._background.submit(self.proximity, distance, **arguments)

    def submit_vertex_distances(self, distance: float, **arguments: Any) -> Future[VertexDistances]:
        """`vertex_distances()` as a future, see `submit_step()`."""
        return self._background.submit(self.vertex_distances, distance, **arguments)

    def submit_intersections(self, **arguments: Any) -> Future[Intersections]:
        """`intersections()` as a future, see `submit_step()`."""
        return self._background.submit(self.intersections, **arguments)

    def submit_commit(self, fraction: float = 1.0, **arguments: Any) -> Future[Committed]:
        """`commit()` as a future, see `submit_step()`."""
        return self._background.submit(self.commit, fraction, **arguments)

    async def step_async(self, positions: Any = ..., **arguments: Any) -> Contacts:
        """`step()` for asyncio, see `submit_step()`."""
        return await asyncio.wrap_future(self.submit_step(positions, **arguments))

    async def place_async(self, positions: Any = ..., **arguments: Any) -> None:
        """`place()` for asyncio, see `submit_step()`."""
        await asyncio.wrap_future(self.submit_place(positions, **arguments))

    async def trial_async(self, positions: Any = ..., **arguments: Any) -> Contacts:
        """`trial()` for asyncio, see `submit_step()`."""
        return await asyncio.wrap_future(self.submit_trial(positions, **arguments))

    async def max_step_async(self, positions: Any = ..., **arguments: Any) -> MaxStep:
        """`max_step()` for asyncio, see `submit_step()`."""
        return await asyncio.wrap_future(self.submit_max_step(positions, **arguments))

    async def proximity_async(self, distance: float, **arguments: Any) -> Contacts:
        """`proximity()` for asyncio, see `submit_step()`."""
        return await asyncio.wrap_future(self.submit_proximity(distance, **arguments))

    async def vertex_distances_async(self, distance: float, **arguments: Any) -> VertexDistances:
        """`vertex_distances()` for asyncio, see `submit_step()`."""
        return await asyncio.wrap_future(self.submit_vertex_distances(distance, **arguments))

    async def intersections_async(self, **arguments: Any) -> Intersections:
        """`intersections()` for asyncio, see `submit_step()`."""
        return await asyncio.wrap_future(self.submit_intersections(**arguments))

    async def commit_async(self, fraction: float = 1.0, **arguments: Any) -> Committed:
        """`commit()` for asyncio, see `submit_step()`."""
        return await asyncio.wrap_future(self.submit_commit(fraction, **arguments))
