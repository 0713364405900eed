"""Trials on other machines: what is sent to them, how they play, and what comes back.

`sending` packs and unpacks at home, `ray_pool` has Ray carry it, `node` and `child` are what happens there.
"""
