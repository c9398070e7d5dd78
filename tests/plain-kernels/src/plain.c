/* The spring sweep as one would write it in C, for comparison: an edge list, a gather by compressed rows, and a gather
   along diagonals, in double and single precision.
   f = k (1 - L/|d|) d, F_a += f, F_b -= f (Zhang et al., Eq. (3), second line), newtons and metres. */

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* Three coordinates per node. */
void plain_edges_f64(size_t nodes, size_t springs, const uint32_t *a, const uint32_t *b, const double *k,
                     const double *rest, const double *restrict x, double *restrict f) {
  memset(f, 0, 3 * nodes * sizeof *f);
  for (size_t e = 0; e < springs; ++e) {
    const double *p = x + 3 * a[e], *q = x + 3 * b[e];
    double dx = q[0] - p[0], dy = q[1] - p[1], dz = q[2] - p[2];
    double s = k[e] * (1.0 - rest[e] / sqrt(dx * dx + dy * dy + dz * dz));
    double *fa = f + 3 * a[e], *fb = f + 3 * b[e];
    fa[0] += s * dx;
    fa[1] += s * dy;
    fa[2] += s * dz;
    fb[0] -= s * dx;
    fb[1] -= s * dy;
    fb[2] -= s * dz;
  }
}

/* Three coordinates per node, each spring from both ends. */
#define GATHER(NAME, T, SQRT)                                                                              \
  void NAME(size_t nodes, const uint32_t *start, const uint32_t *other, const T *restrict k,               \
            const T *restrict rest, const T *restrict x, T *restrict f) {                                  \
    for (size_t i = 0; i < nodes; ++i) {                                                                   \
      T px = x[3 * i], py = x[3 * i + 1], pz = x[3 * i + 2], sx = 0, sy = 0, sz = 0;                       \
      for (uint32_t e = start[i]; e < start[i + 1]; ++e) {                                                 \
        const T *q = x + 3 * other[e];                                                                     \
        T dx = q[0] - px, dy = q[1] - py, dz = q[2] - pz;                                                  \
        T s = k[e] * (1 - rest[e] / SQRT(dx * dx + dy * dy + dz * dz));                                    \
        sx += s * dx;                                                                                      \
        sy += s * dy;                                                                                      \
        sz += s * dz;                                                                                      \
      }                                                                                                    \
      f[3 * i] = sx;                                                                                       \
      f[3 * i + 1] = sy;                                                                                   \
      f[3 * i + 2] = sz;                                                                                   \
    }                                                                                                      \
  }
GATHER(plain_gather_f64, double, sqrt)
GATHER(plain_gather_f32, float, sqrtf)

/* One array per coordinate; k and L by diagonal and lower node, k = L = 0 where there is no spring; each spring from
   both ends, so that both loops vectorise. Places without a spring must not coincide. */
#define STENCIL(NAME, T, SQRT)                                                                             \
  void NAME(size_t nodes, size_t diagonals, const size_t *offset, const T *restrict k,                     \
            const T *restrict rest, const T *restrict x, T *restrict f) {                                  \
    const T *restrict y = x + nodes, *restrict z = y + nodes;                                              \
    T *restrict fx = f, *restrict fy = f + nodes, *restrict fz = f + 2 * nodes;                            \
    memset(f, 0, 3 * nodes * sizeof *f);                                                                   \
    for (size_t j = 0; j < diagonals; ++j) {                                                               \
      size_t o = offset[j];                                                                                \
      const T *kj = k + j * nodes, *rj = rest + j * nodes;                                                 \
      for (size_t i = 0; i + o < nodes; ++i) {                                                             \
        T dx = x[i + o] - x[i], dy = y[i + o] - y[i], dz = z[i + o] - z[i];                                \
        T s = kj[i] * (1 - rj[i] / SQRT(dx * dx + dy * dy + dz * dz));                                     \
        fx[i] += s * dx;                                                                                   \
        fy[i] += s * dy;                                                                                   \
        fz[i] += s * dz;                                                                                   \
      }                                                                                                    \
      for (size_t i = o; i < nodes; ++i) {                                                                 \
        T dx = x[i - o] - x[i], dy = y[i - o] - y[i], dz = z[i - o] - z[i];                                \
        T s = kj[i - o] * (1 - rj[i - o] / SQRT(dx * dx + dy * dy + dz * dz));                             \
        fx[i] += s * dx;                                                                                   \
        fy[i] += s * dy;                                                                                   \
        fz[i] += s * dz;                                                                                   \
      }                                                                                                    \
    }                                                                                                      \
  }
STENCIL(plain_stencil_f64, double, sqrt)
STENCIL(plain_stencil_f32, float, sqrtf)
