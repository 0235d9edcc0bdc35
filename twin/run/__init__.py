"""Edge: loads in, temperatures and TCP error out."""
