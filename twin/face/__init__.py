"""What `import twin` offers and the command line calls: objects or paths in, objects out."""
