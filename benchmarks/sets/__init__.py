"""The shipped networks of prediction on sets of clips, also on those that they never saw."""
