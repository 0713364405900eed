"""Vision-language models: clients behind one protocol, the reading of replies, a cache, planners."""
