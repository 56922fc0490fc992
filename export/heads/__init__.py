"""A 3D head from one photo (Multi-NeuS): the prior of heads and the bundle that a device fits it with."""
