"""Conversations with controllers: what was asked is answered, what moves ends, what comes unasked is heard.

What is decided is in cores without input or output (:mod:`~stagewire.session.core`); sessions drive them, for
threads (:mod:`~stagewire.session.synchronous`) and for asyncio (:mod:`~stagewire.session.asynchronous`).
``docs/sessions.md`` says what they do.
"""
