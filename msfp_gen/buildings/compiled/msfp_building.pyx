# cython: language_level=3, embedsignature=True
"""Run of a linear building on bearings in compiled code (msfp_building.h): `Run`."""

from cpython.exc cimport PyErr_CheckSignals
from cpython.pycapsule cimport PyCapsule_GetPointer
from libc.stdlib cimport calloc, free
from scipy.linalg.cython_blas cimport dsyrk
from scipy.linalg.cython_lapack cimport dgetrf, dgetrs, dpotrf, dpotrs

import numpy as np

cdef extern from "msfp_building.h":
    enum: MSFP_ABI_VERSION
    enum: MSFP_OK
    enum: MSFP_E_MEMORY
    enum: MSFP_BUILDING_COUNTS
    ctypedef struct msfp_api:
        int abi_version
        const char *(*status_name)(int) noexcept nogil
    ctypedef struct msfp_part:
        const msfp_api *api
    ctypedef struct msfp_piecewise:
        int pieces
        const double *knots
        const double *coefficients
    ctypedef struct msfp_lapack:
        void *syrk
        void *potrf
        void *potrs
        void *getrf
        void *getrs
    ctypedef struct msfp_building_scene:
        int n, attachments, bearings, grounds
        const double *mass
        const double *damping
        const double *stiffness
        const double *shares
        const double *shares_turned
        const double *dampers
        const double *springs
        const msfp_part *parts
        const double *rows
        const int *ground_of
        const msfp_piecewise *ground
        const int *entry_count
        const int *entries
        const int *faces
        double weight
        int vectors
        const int *vector_orders
        const double *vector_rows
        const double *vector_grounds
        int nodes
        const double *node_rows
        const double *arms
        const double *stops
        const double *jumps
        int stop_count, jump_count
        const double *span_ends
        const double *span_steps
        int span_count, method
        double rtol, max_step, first_step, max_steps, end, output_step
        int threads, timed
        msfp_lapack lapack
    ctypedef struct msfp_building_progress:
        int status, bearing, surface
        double value, time
        size_t rows
    ctypedef struct msfp_building:
        pass
    msfp_building *msfp_building_new(const msfp_building_scene *) noexcept nogil
    void msfp_building_free(msfp_building *) noexcept nogil
    int msfp_building_advance(msfp_building *, long) noexcept nogil
    void msfp_building_state(const msfp_building *, msfp_building_progress *) noexcept nogil
    void msfp_building_counts(const msfp_building *, long *) noexcept nogil
    size_t msfp_building_peak_count(const msfp_building *) noexcept nogil
    const double *msfp_building_peaks(const msfp_building *) noexcept nogil
    const double *msfp_building_peak_times(const msfp_building *) noexcept nogil
    void msfp_building_ends(msfp_building *, int, double *) noexcept nogil
    int msfp_building_replaced(msfp_building *, int, const int *, const int *) noexcept nogil
    size_t msfp_building_step_count(const msfp_building *) noexcept nogil
    const double *msfp_building_steps(const msfp_building *) noexcept nogil
    size_t msfp_building_row_size(const msfp_building *) noexcept nogil
    const double *msfp_building_rows(const msfp_building *) noexcept nogil
    size_t msfp_building_snapshot_size(const msfp_building *) noexcept nogil
    void msfp_building_snapshot_write(const msfp_building *, void *) noexcept nogil
    int msfp_building_snapshot_read(msfp_building *, const void *, size_t) noexcept nogil

COUNTS = ("steps", "rejected_steps", "newton_iterations", "tangents", "step_lengths")


cdef const double *_doubles(list held, object values) except? NULL:
    """The numbers of an array, which `held` keeps."""
    cdef const double[::1] view = np.ascontiguousarray(values, dtype=float).reshape(-1)
    held.append(view)
    return &view[0] if view.shape[0] else NULL


cdef const int *_ints(list held, object values) except? NULL:
    cdef const int[::1] view = np.ascontiguousarray(values, dtype=np.intc).reshape(-1)
    held.append(view)
    return &view[0] if view.shape[0] else NULL


cdef class Run:
    """The run of a building. See msfp_building.h for what it is given.

    The coordinates are r attachments and m oscillators on them. matrices (3, r, r): mass, damping, stiffness. shares (r, m)
    of the attachments in the oscillators, dampers and springs (m,). ports: the two-ports of all bearings, which take no other steps. rows (bearings, 6, r). grounds: knots and coefficients of each motion. ground_of (bearings,). entries:
    of each bearing, indices into its row. faces (bearings, 9): where contacts and rims are in it. vectors: those of msfp_building.h: orders (k,), rows (k, 3, n), shares of the motions of the
    ground (k, grounds). node_rows (nodes, 6, n). arms (bearings, 2) [m].
    """
    cdef msfp_building *run
    cdef msfp_part *parts
    cdef msfp_piecewise *grounds
    cdef list held
    cdef size_t nodes

    def __cinit__(self, matrices, shares, dampers, springs, ports, rows, grounds, ground_of, entries, faces, vectors, node_rows, arms, *, double weight, stops, jumps,
                  span_ends, span_steps, int method, double rtol, double max_step, double first_step, double max_steps,
                  double end, double output_step, int threads, bint timed):
        cdef msfp_building_scene s
        cdef int i
        held, self.nodes = [ports], len(node_rows)
        self.held = held
        s.attachments, s.bearings, s.grounds = len(matrices[0]), len(ports), len(grounds)
        s.n = s.attachments + len(springs)
        s.mass, s.damping, s.stiffness = _doubles(held, matrices[0]), _doubles(held, matrices[1]), _doubles(held, matrices[2])
        s.shares, s.shares_turned, s.rows = _doubles(held, shares), _doubles(held, np.transpose(shares)), _doubles(held, rows)
        s.dampers, s.springs, s.ground_of = _doubles(held, dampers), _doubles(held, springs), _ints(held, ground_of)
        s.entry_count = _ints(held, [len(each) for each in entries])
        s.entries, s.faces = _ints(held, np.concatenate(entries)), _ints(held, np.ravel(faces))
        s.vectors, s.vector_orders = len(vectors[0]), _ints(held, vectors[0])
        s.vector_rows, s.vector_grounds, s.arms = _doubles(held, vectors[1]), _doubles(held, vectors[2]), _doubles(held, arms)
        s.nodes, s.node_rows = len(node_rows), _doubles(held, node_rows)
        s.weight, s.rtol, s.max_step, s.first_step, s.max_steps = weight, rtol, max_step, first_step, max_steps
        s.end, s.output_step, s.threads, s.timed, s.method = end, output_step, threads, timed, method
        s.stops, s.stop_count, s.jumps, s.jump_count = _doubles(held, stops), len(stops), _doubles(held, jumps), len(jumps)
        s.span_ends, s.span_steps, s.span_count = _doubles(held, span_ends), _doubles(held, span_steps), len(span_ends)
        s.lapack.syrk = <void *>dsyrk
        s.lapack.potrf, s.lapack.potrs, s.lapack.getrf, s.lapack.getrs = <void *>dpotrf, <void *>dpotrs, <void *>dgetrf, <void *>dgetrs
        self.parts = <msfp_part *>calloc(s.bearings, sizeof(msfp_part))
        self.grounds = <msfp_piecewise *>calloc(s.grounds, sizeof(msfp_piecewise))
        if self.parts is NULL or self.grounds is NULL:
            raise MemoryError("no memory for the run of a building")
        for i, port in enumerate(ports):
            self.place(i, port)
        for i, (knots, coefficients) in enumerate(grounds):
            self.grounds[i].pieces = len(coefficients)
            self.grounds[i].knots, self.grounds[i].coefficients = _doubles(held, knots), _doubles(held, coefficients)
        s.parts, s.ground = self.parts, self.grounds
        with nogil:
            self.run = msfp_building_new(&s)
        if self.run is NULL:
            raise MemoryError("no memory for the run of a building")

    def __dealloc__(self):
        msfp_building_free(self.run)
        free(self.parts)
        free(self.grounds)

    def advance(self, long steps):
        """Take up to `steps` steps without the GIL; True while there is more to do. An interrupt is raised after them."""
        cdef int more
        with nogil:
            more = msfp_building_advance(self.run, steps)
        PyErr_CheckSignals()
        return bool(more)

    cdef place(self, int i, port):
        self.parts[i] = (<msfp_part *>PyCapsule_GetPointer(port.capsule, "msfp_part"))[0]
        if self.parts[i].api.abi_version != MSFP_ABI_VERSION:
            raise ImportError(f"a model has ABI version {self.parts[i].api.abi_version}, the building {MSFP_ABI_VERSION}")

    def ends(self, int bearing):
        """Motion of the ends (2, 3, 6) of a bearing, from 0, at the present state."""
        found = np.empty((2, 3, 6))
        cdef double[:, :, ::1] view = found
        msfp_building_ends(self.run, bearing, &view[0, 0, 0])
        return found

    def replace(self, int bearing, port, entries, faces):
        """Continue with another two-port of a bearing, from 0, in its present state; entries, faces: of its row."""
        cdef list held = []
        cdef const int *given = _ints(held, entries)
        cdef const int *contacts = _ints(held, faces)
        self.place(bearing, port)
        self.held.append(port)
        msfp_building_replaced(self.run, bearing, given, contacts)

    cdef msfp_building_progress progress(self):
        cdef msfp_building_progress found
        msfp_building_state(self.run, &found)
        return found

    @property
    def status(self):
        """Status name; bearing from 1, 0: the building; its surface from 1, 0: none; value."""
        cdef msfp_building_progress found = self.progress()
        return self.parts[0].api.status_name(found.status).decode(), found.bearing, found.surface, found.value

    @property
    def time(self):
        """Time reached [s]."""
        return self.progress().time

    @property
    def rows(self):
        """Rows (T, size), a copy."""
        cdef size_t count = self.progress().rows, size = msfp_building_row_size(self.run)
        if not count:
            return np.zeros((0, size))
        cdef const double[:, ::1] view = <double[:count, :size]>msfp_building_rows(self.run)
        return np.array(view)

    @property
    def row_count(self):
        """How many they are."""
        return self.progress().rows

    @property
    def steps(self):
        """Time and accelerations of the nodes at the start and the end of every step (steps + 1, 1 + 6 nodes), a copy."""
        cdef size_t count = msfp_building_step_count(self.run), size = 1 + 6 * self.nodes
        if not count:
            return np.zeros((0, size))
        cdef const double[:, ::1] view = <double[:count, :size]>msfp_building_steps(self.run)
        return np.array(view)

    @property
    def peaks(self):
        """Peaks over all steps and when each was reached first [s], one number after the other, (2, peaks); see
        msfp_building.h."""
        cdef const double[::1] view = <double[:msfp_building_peak_count(self.run)]>msfp_building_peaks(self.run)
        cdef const double[::1] times = <double[:msfp_building_peak_count(self.run)]>msfp_building_peak_times(self.run)
        return np.array([view, times])

    @property
    def counts(self):
        """Counters, see COUNTS."""
        cdef long found[MSFP_BUILDING_COUNTS]
        msfp_building_counts(self.run, found)
        return {name: found[i] for i, name in enumerate(COUNTS)}

    def snapshot(self):
        """State with all rows, as bytes."""
        cdef bytearray found = bytearray(msfp_building_snapshot_size(self.run))
        cdef char *to = found
        msfp_building_snapshot_write(self.run, to)
        return bytes(found)

    def restore(self, bytes snapshot):
        """Continue from a snapshot of a run of the same scene and build. Raises ValueError, MemoryError."""
        cdef const char *given = snapshot
        cdef int status = msfp_building_snapshot_read(self.run, given, len(snapshot))
        if status == MSFP_E_MEMORY:
            raise MemoryError("no memory for a snapshot")
        if status != MSFP_OK:
            raise ValueError("these bytes are no snapshot of a run of this building")
