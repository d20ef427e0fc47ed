/* balance of angular momentum (3.27), (3.29) about the centre of mass: left side less right side, along t_i.
 * 80 operations; out: angular. */
MSFP_INLINED
static inline void msfp_angular_balance(const double *restrict par /* body_parameters */, const double *restrict b /* body */, const double *restrict lo /* force */, const double *restrict ml /* moment */, const double *restrict up /* force */, const double *restrict mu /* moment */, double *restrict out)
{
    const double par_c = par[0];
    const double par_e = par[1];
    const double par_jt = par[3];
    const double par_ja = par[4];
    const double b_t1x = b[0];
    const double b_t1y = b[1];
    const double b_t1z = b[2];
    const double b_t2x = b[3];
    const double b_t2y = b[4];
    const double b_t2z = b[5];
    const double b_t3x = b[6];
    const double b_t3y = b[7];
    const double b_t3z = b[8];
    const double b_wpx = b[12];
    const double b_wpy = b[13];
    const double b_wpz = b[14];
    const double b_alpx = b[18];
    const double b_alpy = b[19];
    const double b_alpz = b[20];
    const double lo_Fx = lo[0];
    const double lo_Fy = lo[1];
    const double lo_Fz = lo[2];
    const double ml_Mx = ml[0];
    const double ml_My = ml[1];
    const double ml_Mz = ml[2];
    const double up_Fx = up[0];
    const double up_Fy = up[1];
    const double up_Fz = up[2];
    const double mu_Mx = mu[0];
    const double mu_My = mu[1];
    const double mu_Mz = mu[2];
    const double s_1 = -par_c + par_e;
    const double gx_2 = lo_Fx*par_c + s_1*up_Fx;
    const double gy_3 = lo_Fy*par_c + s_1*up_Fy;
    const double gz_4 = lo_Fz*par_c + s_1*up_Fz;
    const double s_5 = par_ja - par_jt;
    const double s_6 = b_t3x*b_wpx + b_t3y*b_wpy + b_t3z*b_wpz;
    const double s_7 = b_alpx*b_t3x + b_alpy*b_t3y + b_alpz*b_t3z;
    const double gyx_8 = -b_t3y*b_wpz + b_t3z*b_wpy;
    const double gyy_9 = b_t3x*b_wpz - b_t3z*b_wpx;
    const double gyz_10 = -b_t3x*b_wpy + b_t3y*b_wpx;
    const double s_11 = s_5*s_7;
    const double s_12 = s_5*s_6;
    const double hdotx_13 = b_alpx*par_jt + b_t3x*s_11 + gyx_8*s_12;
    const double hdoty_14 = b_alpy*par_jt + b_t3y*s_11 + gyy_9*s_12;
    const double hdotz_15 = b_alpz*par_jt + b_t3z*s_11 + gyz_10*s_12;
    const double rx_16 = b_t3y*gz_4 - b_t3z*gy_3 + hdotx_13 - ml_Mx + mu_Mx;
    const double ry_17 = -b_t3x*gz_4 + b_t3z*gx_2 + hdoty_14 - ml_My + mu_My;
    const double rz_18 = b_t3x*gy_3 - b_t3y*gx_2 + hdotz_15 - ml_Mz + mu_Mz;
    const double out_19 = b_t1x*rx_16 + b_t1y*ry_17 + b_t1z*rz_18;
    const double out_20 = b_t2x*rx_16 + b_t2y*ry_17 + b_t2z*rz_18;
    const double out_21 = b_t3x*rx_16 + b_t3y*ry_17 + b_t3z*rz_18;
    out[0] = out_19; /* rx */
    out[1] = out_20; /* ry */
    out[2] = out_21; /* rz */
}
