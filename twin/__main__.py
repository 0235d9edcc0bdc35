"""`python -m twin`: the command line where its folder is on no path."""

from twin.cli.main import main

if __name__ == "__main__":
    main()
