"""Networks of others, permissively licensed, that label real photographs: boxes, 33 landmarks, masks.

They teach and check; the backbone of one is where ours starts (`backbone.py`).
"""
