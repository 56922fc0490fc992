"""Networks of others, permissively licensed, that label real photographs: boxes, 33 landmarks, masks.

They teach and check; none of their weights enter ours.
"""
