"""The netbook's programs: whiskerd, the ring beside other transports, recordings, the live view."""
