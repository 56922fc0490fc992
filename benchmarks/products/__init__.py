"""The SDK beside other products on the same photographs and clips."""
