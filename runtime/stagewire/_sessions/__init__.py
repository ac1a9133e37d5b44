"""Sessions with controllers: requests, replies, motions, subscriptions.

Sans-I/O cores decide (:mod:`~stagewire._sessions.core`). Sessions drive them, for threads
(:mod:`~stagewire._sessions.synchronous`) and for asyncio (:mod:`~stagewire._sessions.asynchronous`).
``docs/explanation/sessions.md`` describes the behaviour.
"""
