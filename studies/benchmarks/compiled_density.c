/* Whitened residuals of points on a finger, or the sums of their squares: the pass that `compiled.py` times.

   M elements (a constant of the compiler, so that loops over them become vector instructions), B touches of W points
   each. The table has M readings a row; kappa is P R/mu. Whiteners are lower triangular, given by columns. */
#include <math.h>

#define LANES 16

typedef struct {
    const float *rows;
    int n_kappa, n_angles;
    double kappa_scale, kappa_first, kappa_step, angle_first, angle_step, modulus;
} Table;

/* Prediction minus reading of `n` points of one touch, element by element. */
static inline void compare(const Table *table, const double *restrict radius, const double *restrict angle,
                           const double *restrict load, const float *restrict reading, int n,
                           float miss[M][LANES])
{
    const float scale = 1 / (1000 * table->modulus * table->kappa_scale);
    float across[LANES], along_share[LANES];
    int place[LANES];
    for (int q = 0; q < n; q++) {
        float kappa = fmaxf((float)(load[q] * radius[q]) * scale, 0.0f);
        across[q] = (log1pf(kappa) - (float)table->kappa_first) / (float)table->kappa_step;
        across[q] = fminf(fmaxf(across[q], 0.0f), table->n_kappa - 1.001f);
        double along = (angle[q] - table->angle_first) / table->angle_step;
        along = fmin(fmax(along, 0.0), table->n_angles - 1.001);
        place[q] = (int)across[q] * table->n_angles + (int)along;
        along_share[q] = (float)(along - (int)along);
    }
    for (int q = 0; q < n; q++) {
        const float *restrict low = table->rows + (long)place[q] * M;
        const float *restrict high = low + (long)table->n_angles * M;
        const float s = across[q] - (int)across[q], t = along_share[q], force = (float)load[q];
        float one[M];
        for (int e = 0; e < M; e++) {
            float lower = low[e] + t * (low[e + M] - low[e]), upper = high[e] + t * (high[e + M] - high[e]);
            one[e] = (lower + s * (upper - lower)) * force - reading[e];
        }
        for (int e = 0; e < M; e++) miss[e][q] = one[e];
    }
}

static inline void whiten(const float *restrict columns, int e, float miss[M][LANES], float white[LANES])
{
    for (int q = 0; q < LANES; q++) white[q] = 0;
    for (int f = 0; f <= e; f++)
        for (int q = 0; q < LANES; q++) white[q] += columns[f * M + e] * miss[f][q];
}

/* out (B, W), or (B, W, M) if `squared` is 0 */
void density(const Table *table, const double *radius, const double *angle, const double *load, const float *readings,
             const float *columns, int B, int W, int squared, float *restrict out)
{
    float miss[M][LANES] = {{0}}, white[LANES];
    for (int b = 0; b < B; b++)
        for (int first = 0; first < W; first += LANES) {
            const long at = (long)b * W + first;
            const int n = W - first < LANES ? W - first : LANES;
            float total[LANES] = {0};
            compare(table, radius + at, angle + at, load + at, readings + (long)b * M, n, miss);
            for (int e = 0; e < M; e++) {
                whiten(columns + (long)b * M * M, e, miss, white);
                if (squared)
                    for (int q = 0; q < LANES; q++) total[q] += white[q] * white[q];
                else
                    for (int q = 0; q < n; q++) out[(at + q) * M + e] = white[q];
            }
            if (squared)
                for (int q = 0; q < n; q++) out[at + q] = total[q];
        }
}
