"""The web application that `motionary browse` serves: pages over one catalog."""
