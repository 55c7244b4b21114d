"""beacon-mj: contact-revealed navigation in MuJoCo."""
