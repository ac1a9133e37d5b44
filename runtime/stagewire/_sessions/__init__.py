"""Sessions with controllers: requests, replies, motions, subscriptions.

Cores without input or output decide (:mod:`~stagewire._sessions.core`); sessions drive them, for threads
(:mod:`~stagewire._sessions.synchronous`) and for asyncio (:mod:`~stagewire._sessions.asynchronous`).
``docs/explanation/sessions.md`` describes what they do.
"""
