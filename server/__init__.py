"""The top floor: HTTP, WebSocket, 3D scene, sign-in, settings, command line and process supervision."""
