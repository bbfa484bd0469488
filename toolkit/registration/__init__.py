"""Registration: the target's shape on the source's topology, from landmark pairs and feature lines."""

from toolkit.registration.engine import Registration, register
from toolkit.registration.landmarks import Landmarks, load_landmarks, save_landmarks
from toolkit.registration.parameters import RegistrationParameters
from toolkit.registration.quality import RegistrationQuality

__all__ = [
    "Landmarks",
    "Registration",
    "RegistrationParameters",
    "RegistrationQuality",
    "load_landmarks",
    "register",
    "save_landmarks",
]
