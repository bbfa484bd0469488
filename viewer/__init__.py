"""The Open3D application: side-by-side comparison, point picking and editing. Comes with a later issue."""
