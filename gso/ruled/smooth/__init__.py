"""Smooth strips: B-spline surfaces of degree one by three with a constant normal on rulings.

Strips of planar faces are interpolated by cubic curves through the ends of their rulings
(:mod:`~gso.ruled.smooth.curves`). The tangent plane is made constant along every ruling
(:mod:`~gso.ruled.smooth.smooth_fit`), and the outline is carried over
(:mod:`~gso.ruled.smooth.smooth_trim`).
"""
