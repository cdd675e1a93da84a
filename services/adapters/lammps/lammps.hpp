// SPDX-License-Identifier: MIT
#pragma once
// LAMMPS's C interface with MPI.

#include <mpi.h>

#ifndef LAMMPS_LIB_MPI
#define LAMMPS_LIB_MPI  // without it there is no lammps_open()
#endif
#include <lammps/library.h>
