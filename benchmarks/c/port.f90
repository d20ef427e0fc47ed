! CPU time of a committed step of a two-port [ns], without and with its tangent, as port.c. See embedding.py.
program port_steps
   use msfp
   implicit none
   include "values.inc"
   real(c_double), parameter :: w = 3.14159265358979d0, displacements(3) = [1d0, 0d0, 0d0]
   type(msfp_model) :: model
   type(msfp_scene) :: scene
   type(c_ptr) :: bearing, port, message
   real(c_double) :: ends(6, 3, 2), wrench(6, 2), tangent(12, 12), begin, end, least(2), s, c
   integer(c_int) :: status
   integer :: i, round, kind

   model = msfp_load(msfp_5_2_2())
   status = model%bearing_new(gravity, bodies, surfaces, top, bearing, message)
   if (status /= MSFP_OK) stop 1
   call model%scene_default(scene)
   scene%bearing = bearing
   scene%rtol = rtol
   scene%atol_angle = atol
   least = huge(1d0)
   do round = 1, rounds
      do kind = 1, 2
         status = model%port_new(scene, load, port, message)
         call cpu_time(begin)
         do i = 1, count
            s = sin(w*step*i)
            c = cos(w*step*i)
            ends = 0
            ends(1, :, 2) = [0.06d0*s**3, 0.06d0*3*w*s**2*c, 0.06d0*3*w**2*(2*s*c**2 - s**3)]
            status = max(status, model%port_trial(port, step*i, ends, message))
            status = max(status, model%port_wrench(port, wrench))
            if (kind == 2) status = max(status, model%port_derivative(port, displacements, tangent))
            status = max(status, model%port_commit(port))
         end do
         call cpu_time(end)
         if (status /= MSFP_OK) stop 1
         least(kind) = min(least(kind), 1d9*(end - begin)/count)
         call model%port_free(port)
      end do
   end do
   print "(2es14.6)", least
end program port_steps
