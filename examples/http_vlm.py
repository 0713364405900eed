"""A VLM client of one's own: a class with one method. This one asks a model behind a small HTTP server of one's own.

The server gets {"system": text, "examples": [{"user": text, "reply": text}], "prompt": text, "images": [PNG as base64],
"schema": JSON schema, "seed": number} and answers {"text": what the model wrote}.

cd examples
torc run --planner vlm-select --vlm http_vlm:HttpVlm:my-model@http://localhost:8500/ask
"""

import base64
import json
import time
import urllib.error
import urllib.request
from dataclasses import asdict

from torc import InputError, VlmConfig
from torc.protocols import FailureKind, Question, Reply, VlmError, kind_of_status, reply_of


class HttpVlm:
    """Asks once, and says what went wrong if there is no reply."""

    def __init__(self, config: VlmConfig) -> None:
        if config.base_url is None:
            raise InputError("Say where the model is: --vlm http_vlm:HttpVlm@http://localhost:8500/ask")
        self.config = config

    def ask(self, question: Question) -> Reply:
        """The model's reply. Raises VlmError if the server gives none."""
        images = [base64.b64encode(png).decode() for png in question.images]
        asked = {
            "system": question.system,
            "examples": [asdict(example) for example in question.examples],
            "prompt": question.prompt,
            "images": images,
            "schema": question.schema,
            "seed": question.repeat,
        }
        request = urllib.request.Request(
            self.config.url, json.dumps(asked).encode(), {"Content-Type": "application/json"}
        )
        started = time.perf_counter()
        try:
            with urllib.request.urlopen(request, timeout=self.config.timeout_s) as response:
                text = json.load(response)["text"]
        except urllib.error.HTTPError as error:
            error.close()
            raise self._failure(kind_of_status(error.code), f"HTTP {error.code}") from error
        except TimeoutError as error:
            raise self._failure(FailureKind.TIMEOUT, str(error)) from error
        except OSError as error:
            raise self._failure(FailureKind.CONNECTION, str(error)) from error
        except (ValueError, LookupError, TypeError) as error:
            raise self._failure(FailureKind.BAD_RESPONSE, str(error)) from error
        return reply_of(str(text), self.config.text, latency_s=time.perf_counter() - started)

    def _failure(self, kind: FailureKind, detail: str) -> VlmError:
        return VlmError(self.config.text, kind, detail, tries=1)
