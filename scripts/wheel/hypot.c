#include <math.h>

/* hypot as glibc 2.35 and later have it, so that results are the same on all systems (C. F. Borges, "An improved
 * algorithm for hypot(a,b)", 2019). Arguments far from 1 are scaled. */
static double length(double a, double b) {
#ifdef __FP_FAST_FMA
  const double difference = a - b;
  return 2 * b >= a ? sqrt(fma(2 * b, a, difference * difference)) : sqrt(fma(a, a, b * b));
#else
  const double h = sqrt(a * a + b * b);
  double first, second;
  if (h <= 2 * b) {
    const double delta = h - b;
    first = a * (2 * delta - a);
    second = (delta - 2 * (a - b)) * delta;
  } else {
    const double delta = h - a;
    first = 2 * delta * (a - 2 * b);
    second = (4 * delta - b) * b + delta * delta;
  }
  return h - (first + second) / (2 * h);
#endif
}

double hypot(double x, double y) {
  if (isinf(x) || isinf(y)) return INFINITY;
  if (isnan(x) || isnan(y)) return x + y;
  x = fabs(x), y = fabs(y);
  const double a = x < y ? y : x, b = x < y ? x : y;
  if (b <= a * 0x1p-54) return a + b;
  if (a > 0x1p+511) return length(a * 0x1p-600, b * 0x1p-600) * 0x1p+600;
  if (b < 0x1p-459) return length(a * 0x1p+600, b * 0x1p+600) * 0x1p-600;
  return length(a, b);
}

float hypotf(float x, float y) {
  if (isinf(x) || isinf(y)) return INFINITY;
  return (float)sqrt((double)x * (double)x + (double)y * (double)y);
}
