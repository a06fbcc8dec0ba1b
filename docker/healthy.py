"""Whether the server answers, by TLS or without; its certificate is not the question here."""

import os
import ssl
import urllib.error
import urllib.request

ADDRESS = f"127.0.0.1:{os.environ['HEDGEHOP_PORT']}/api/health"
try:
    urllib.request.urlopen(f"http://{ADDRESS}", timeout=2)
except (urllib.error.URLError, OSError):
    urllib.request.urlopen(f"https://{ADDRESS}", timeout=2, context=ssl._create_unverified_context())
