"""A study on the processes of MPI: `mpiexec -n 33 python -m mpi4py.futures mpi.py study.toml out`."""

import sys

from mpi4py.futures import MPIPoolExecutor

from msfp_gen import study

if __name__ == "__main__":
    with MPIPoolExecutor() as executor:
        print(study(sys.argv[1], sys.argv[2], executor=executor))
