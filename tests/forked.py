"""Processes that have imported compgen when they begin: for most commands importing takes longer than their work.

One process imports all, another the command line alone, and each forks itself for what is asked of it. The fork has a
folder, an environment, streams and signals of its own and ends as Python ends. What is asked of importing itself, or of
threads, starts Python.
"""

import atexit
import json
import os
import socket
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import cache

from shipped import ROOT

HANGS_S = 900  # a run that hangs, on however busy a machine
#: what a process imports before it forks itself
EVERYTHING = "import compgen.cli.blas_threads, shipped; shipped.load_everything()"
COMMAND_LINE = "import compgen.cli.main"  # for a help or a completion
SERVER = """
import gc, json, os, signal, socket, sys
sys.path[:0] = {path}
{loading}
gc.freeze()  # else the end of a fork takes apart all that is here
sys.dont_write_bytecode = True
with socket.socket(fileno={number}) as calls:
    while True:
        request, streams, *_ = socket.recv_fds(calls, 2**20, 3)
        child = os.fork() if request else sys.exit()
        if child == 0:
            break
        for stream in streams:
            os.close(stream)
        calls.send(str(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])).encode())
for number, stream in enumerate(streams):
    os.dup2(stream, number)
    os.close(stream)
signal.alarm({hangs})
code, folder, environment = json.loads(request)
os.chdir(folder)
os.environ.clear()
os.environ.update(environment)
exec(code)
"""
COMMAND = """
import sys
sys.path.insert(0, {root!r})
sys.argv = ["cgen", *{arguments!r}]
from compgen.__main__ import main
main()
"""


def code_of(arguments):
    """Python that runs the command line."""
    return COMMAND.format(root=str(ROOT), arguments=list(map(str, arguments)))


@cache
def _server(loading):
    """The process that forks itself, by the socket on which it listens; it ends with this one."""
    ours, its = socket.socketpair()
    code = SERVER.format(path=[str(ROOT), str(ROOT / "tests")], number=its.fileno(), hangs=HANGS_S, loading=loading)
    process = subprocess.Popen([sys.executable, "-c", code], pass_fds=[its.fileno()])
    its.close()
    atexit.register(process.wait)
    atexit.register(ours.close)  # before the wait: the last that is registered is called first
    return ours


def run_forked(code, cwd=ROOT, stdout=None, loading=EVERYTHING, **environment):
    """Run Python code in a fork to its end, as ``subprocess.run`` tells it; its output may go to ``stdout``."""
    (output, its_output), (errors, its_errors) = os.pipe(), os.pipe()
    with open(os.devnull) as nothing, ThreadPoolExecutor(2) as readers:
        texts = [readers.submit(_text, end) for end in (output, errors)]
        try:
            request = json.dumps([code, str(cwd), {**os.environ, **environment}]).encode()
            streams = [nothing.fileno(), its_output if stdout is None else stdout, its_errors]
            socket.send_fds(_server(loading), [request], streams)
        finally:
            os.close(its_output)
            os.close(its_errors)
        output, errors = (text.result() for text in texts)
        return subprocess.CompletedProcess(code, int(_server(loading).recv(100)), output, errors)


def _text(end):
    with open(end) as stream:
        return stream.read()
