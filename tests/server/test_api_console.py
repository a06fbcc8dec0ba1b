"""The console's files and the pages around it."""

from __future__ import annotations

import re
from pathlib import Path

from tests.server.running import Running, running

OUTSIDE = ["%2e%2e/secret.txt", "..%2fsecret.txt", "%2e%2e%2fsecret.txt", "%2fetc%2fpasswd", "%00", "a/..%2f..%2fx"]


def test_without_a_built_console_the_page_says_what_to_do(served: Running) -> None:
    response = served.http.get("/")
    assert response.status_code == 503
    assert "make setup" in response.text


def test_health_needs_no_session(served: Running) -> None:
    with served.stranger() as client:
        assert client.get("/api/health").json()["status"] == "ok"


def test_the_api_is_documented_without_foreign_scripts(served: Running) -> None:
    page = served.http.get("/api/docs")
    assert "/api/plan/shortest_order" in page.text
    assert "http://" not in page.text
    assert "https://" not in page.text
    assert "script-src 'none'" in page.headers["content-security-policy"]
    whole = served.http.get("/api/openapi.json")
    paths, documents = whole.json()["paths"], whole.json()["components"]["schemas"]
    assert "application/octet-stream" in paths["/api/terrains"]["post"]["requestBody"]["content"]
    refused = paths["/api/terrains"]["post"]["responses"]["409"]
    assert refused["description"] == "Conflict"
    assert refused["content"]["application/json"]["schema"] == {"$ref": "#/components/schemas/ErrorDoc"}
    assert set(re.findall(r'"#/components/schemas/([^"]+)"', whole.text)) <= set(documents)


def test_unknown_paths_and_methods_answer_in_json(served: Running) -> None:
    assert served.http.get("/nowhere").json()["code"] == "not_found"
    assert served.http.patch("/api/plan").json()["code"] == "method_not_allowed"


def test_nothing_outside_the_console_is_served(tmp_path: Path) -> None:
    console = tmp_path / "console"
    (console / "assets").mkdir(parents=True)
    (console / "assets" / "main.js").write_text("1")
    (console / "index.html").write_text("<!doctype html>hello")
    (console / "secret.txt").write_text("secret")
    (console / "assets" / "link").symlink_to("/etc/passwd")
    with running(tmp_path / "data", console_dir=console) as server:
        assert server.http.get("/").text == "<!doctype html>hello"
        assert "immutable" in server.http.get("/assets/main.js").headers["cache-control"]
        assert server.http.get("/assets/link").status_code == 404
        for path in OUTSIDE:
            response = server.http.get(f"/assets/{path}")
            assert response.status_code == 404, path
            assert "secret" not in response.text


def test_help_is_served_to_those_who_are_signed_in(tmp_path: Path) -> None:
    pages = tmp_path / "console" / "help"
    pages.mkdir(parents=True)
    (pages / "index.html").write_text("<!doctype html>contents")
    (pages / "fly.webp").write_bytes(b"RIFF")
    (tmp_path / "console" / "secret.txt").write_text("secret")
    with running(tmp_path / "data", console_dir=tmp_path / "console") as server:
        assert server.http.get("/help", follow_redirects=True).text == "<!doctype html>contents"
        assert server.http.get("/help/index.html").headers["content-type"].startswith("text/html")
        assert server.http.get("/help/fly.webp").headers["content-type"] == "image/webp"
        for path in OUTSIDE:
            assert server.http.get(f"/help/{path}").status_code == 404, path
        with server.stranger() as client:
            answer = client.get("/help/index.html")
            assert (answer.status_code, answer.headers["location"]) == (303, "/signin")


def test_who_is_signed_in_learns_how_late_the_loop_is_and_what_is_confined(served: Running) -> None:
    with served.stranger() as client:
        assert client.get("/api/health").json().keys() == {"status", "version"}
    health = served.http.get("/api/health").json()
    assert 0 <= health["loop"]["p99_ms"] <= health["loop"]["longest_ms"]
    assert "decoders" in health["confinement"]
