"""The robot's part of the page in headless Chromium, on a server in the test's own process."""

import asyncio
from contextlib import asynccontextmanager

import chromium
from viewrobot import Post, robot_view

DRAWN = "robotPart.drawn > 1 && robotPart.world.belief.poses && robotPart.world.word"


@asynccontextmanager
async def looking_at(post: Post, theme: str = "light", size=(1280, 900), **view):
    """The page on a server that shows this robot; gives browser and hub."""
    async with robot_view(post, **view) as (port, hub), chromium.browser() as b:
        await b.look(f"http://127.0.0.1:{port}/#theme={theme}", *size)
        yield b, hub
        assert b.troubles == []


@asynccontextmanager
async def going_on(post: Post, run, row: int):
    """While this lasts, rows come, ten a second."""

    async def send_for_ever():
        now = row
        while True:
            for topic, message in run.messages(now):
                post.put(topic, message)
            now += 1
            await asyncio.sleep(0.1)

    task = asyncio.create_task(send_for_ever())
    yield
    task.cancel()
