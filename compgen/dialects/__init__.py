"""Program text of robot controllers; the only rooms with millimetres and degrees."""
