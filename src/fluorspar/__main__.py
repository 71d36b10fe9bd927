"""`python -m fluorspar`: the command line where the script `fluorspar` is not on the path."""

from fluorspar.cli.main import main

if __name__ == "__main__":
    main()
