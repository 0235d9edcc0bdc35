"""Installed beside the machine: a systemd unit and a container file."""
