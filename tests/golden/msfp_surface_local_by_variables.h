MSFP_INLINED
static inline void msfp_surface_local_by_variables(const double *restrict b, const double *restrict a, const double *restrict x, const double *restrict y, const double *restrict tot, const double *restrict rim, const double *restrict db, const double *restrict da, const double *restrict dx, const double *restrict dy, const double *restrict dtot, const double *restrict drim, double *restrict dout)
{
    const double b_t1x = b[0];
    const double b_t1y = b[1];
    const double b_t1z = b[2];
    const double b_t2x = b[3];
    const double b_t2y = b[4];
    const double b_t2z = b[5];
    const double b_t3x = b[6];
    const double b_t3y = b[7];
    const double b_t3z = b[8];
    const double a_sp = a[39];
    const double a_cp = a[40];
    const double a_st = a[41];
    const double a_ct = a[42];
    const double x_theta1 = x[4];
    const double x_phi1 = x[5];
    (void)y;
    const double tot_Fx = tot[0];
    const double tot_Fy = tot[1];
    const double tot_Fz = tot[2];
    (void)rim;
    const double s_1 = -a_ct*a_sp;
    const double s_2 = a_cp*a_ct;
    for (int c = 0; c < MSFP_DOF; ++c) {
        const double d_b_t1x = db[0 * MSFP_DOF + c];
        const double d_b_t1y = db[1 * MSFP_DOF + c];
        const double d_b_t1z = db[2 * MSFP_DOF + c];
        const double d_b_t2x = db[3 * MSFP_DOF + c];
        const double d_b_t2y = db[4 * MSFP_DOF + c];
        const double d_b_t2z = db[5 * MSFP_DOF + c];
        const double d_b_t3x = db[6 * MSFP_DOF + c];
        const double d_b_t3y = db[7 * MSFP_DOF + c];
        const double d_b_t3z = db[8 * MSFP_DOF + c];
        const double d_a_sp = da[39 * MSFP_DOF + c];
        const double d_a_cp = da[40 * MSFP_DOF + c];
        const double d_a_st = da[41 * MSFP_DOF + c];
        const double d_a_ct = da[42 * MSFP_DOF + c];
        const double d_x_psi1 = dx[3 * MSFP_DOF + c];
        const double d_x_theta1 = dx[4 * MSFP_DOF + c];
        const double d_x_phi1 = dx[5 * MSFP_DOF + c];
        const double d_y_phi1 = dy[5 * MSFP_DOF + c];
        const double d_tot_Fx = dtot[0 * MSFP_DOF + c];
        const double d_tot_Fy = dtot[1 * MSFP_DOF + c];
        const double d_tot_Fz = dtot[2 * MSFP_DOF + c];
        const double d_rim_fx = drim[0 * MSFP_DOF + c];
        const double d_rim_fy = drim[1 * MSFP_DOF + c];
        const double d_rim_fz = drim[2 * MSFP_DOF + c];
        const double d_s_1 = -a_sp*d_a_ct - a_ct*d_a_sp;
        const double d_s_2 = a_ct*d_a_cp + a_cp*d_a_ct;
        const double d_out_3 = tot_Fx*d_b_t1x + tot_Fy*d_b_t1y + tot_Fz*d_b_t1z - d_rim_fx + b_t1x*d_tot_Fx + b_t1y*d_tot_Fy + b_t1z*d_tot_Fz;
        const double d_out_4 = tot_Fx*d_b_t2x + tot_Fy*d_b_t2y + tot_Fz*d_b_t2z - d_rim_fy + b_t2x*d_tot_Fx + b_t2y*d_tot_Fy + b_t2z*d_tot_Fz;
        const double d_out_5 = tot_Fx*d_b_t3x + tot_Fy*d_b_t3y + tot_Fz*d_b_t3z - d_rim_fz + b_t3x*d_tot_Fx + b_t3y*d_tot_Fy + b_t3z*d_tot_Fz;
        const double d_out_6 = x_phi1*d_a_st + a_st*d_x_phi1 + d_x_psi1;
        const double d_out_7 = x_theta1*d_a_cp + x_phi1*d_s_1 + s_1*d_x_phi1 + a_cp*d_x_theta1;
        const double d_out_8 = x_theta1*d_a_sp + x_phi1*d_s_2 + s_2*d_x_phi1 + a_sp*d_x_theta1 - d_y_phi1;
        dout[0 * MSFP_DOF + c] = d_out_3;
        dout[1 * MSFP_DOF + c] = d_out_4;
        dout[2 * MSFP_DOF + c] = d_out_5;
        dout[3 * MSFP_DOF + c] = d_out_6;
        dout[4 * MSFP_DOF + c] = d_out_7;
        dout[5 * MSFP_DOF + c] = d_out_8;
    }
}
