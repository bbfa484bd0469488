"""Mien's processing toolkit: registration, decomposition, transfer and editing of facial performances.

Pure functions and small solver objects on arrays. It needs no display and no GPU, and never imports the viewer
or the scripts. Nothing heavy is imported here, so that ``import toolkit`` stays quick.
"""
