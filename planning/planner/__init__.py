"""The main job: a request and a surface model, or the part of it that is needed, become a certified plan."""
