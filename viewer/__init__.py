"""The Open3D application: ``python -m viewer SHOT``.

``state`` and ``modes`` say what is shown and what each gesture does, without Open3D and without a display; ``view`` is
the thin layer that draws them and turns the window's events into ours; `picking`, `shading`, `overlay` and `timeline`
are the arrays between the two.
"""
