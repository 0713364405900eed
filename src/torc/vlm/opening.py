"""From a configuration to a client that is ready to be asked."""

from torc.vlm.cache import CacheConfig, CachedClient, CacheMode
from torc.vlm.clients.opening import open_api_client
from torc.vlm.config import VlmConfig
from torc.vlm.protocol import VlmClient


def planner_options(config: VlmConfig | None, cache: CacheConfig | None) -> dict[str, VlmClient]:
    """The options of a planner that asks this model; none without a model. Raises as `open_client`."""
    return {} if config is None else {"client": open_client(config, cache)}


def open_client(config: VlmConfig, cache: CacheConfig | None = None) -> VlmClient:
    """A client of the model, with its cache if there is one.

    Replaying needs neither key nor library. Raises InputError without a key or a cache to replay, and
    MissingDependencyError without the vendor's library.
    """
    if cache is None or cache.mode is CacheMode.OFF:
        return open_api_client(config)
    if cache.mode is CacheMode.REPLAY:
        return CachedClient(config, cache.directory)
    return CachedClient(config, cache.directory, open_api_client(config))
