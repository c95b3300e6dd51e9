# What a first run costs on two quiet cores, as measured; set-up and build print it.
DEMO_PACKAGES="340 MB, half a minute"
ALL_PACKAGES="1.3 GB, about a minute"
DEMO_COMPILE="about a minute"
ALL_COMPILE="about two and a half minutes"
