"""Drills: the whole simulated robot at the wall's pace while its parts are killed, slowed, cut off and pulled out."""
