"""What kernels that run the manual's pages are told."""

# A line for a shell: what it says comes as a file would have it, without colours, bars and lines
# of progress ("Building 1/14 walk"), in one piece; and the build ends where it fails.
SHELL = """
import os as _os, re as _re, subprocess as _subprocess

def _shell(line):
    kept = {name: value for name, value in _os.environ.items() if "COLOR" not in name}
    words = {"shell": True, "env": kept, "text": True, "stdout": -1, "stderr": -2}
    done = _subprocess.run(line, **words)
    print(_re.sub(r"^[A-Z]\\w+ \\d+/\\d+ .*\\n", "", done.stdout, flags=_re.M), end="")
    done.check_returncode()

get_ipython().system = _shell
"""

c = get_config()  # noqa: F821 - IPython gives it
c.IPKernelApp.log_level = "ERROR"  # nothing of how kernels are reached
c.IPKernelApp.exec_lines = [SHELL]
