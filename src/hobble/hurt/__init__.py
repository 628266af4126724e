"""Makes hurt versions of healthy clips, modelled on the impaired walks of real people."""
