"""Real photographs and clips from packages: people to look at, places without people to render them in."""
