// What the C++ of osimlite's kernels is written with: Python's arithmetic, tuples, and numbers with derivatives.
//
// It throws nothing, keeps nothing, and includes the two headers below only. Compile without -ffast-math and with
// -ffp-contract=off: results are meant to be the same bits from every compiler.
#pragma once

#include <cmath>
#include <cstdint>

#if defined(__FAST_MATH__)
#error "osimlite's kernels need the arithmetic of IEEE 754: compile without -ffast-math"
#endif

#if defined(__GNUC__) || defined(__clang__)
#define OSIMLITE_INLINE __attribute__((always_inline)) inline
#else
#define OSIMLITE_INLINE inline
#endif
#if defined(_WIN32)
#define OSIMLITE_EXPORT extern "C" __declspec(dllexport)
#elif defined(__GNUC__) || defined(__clang__)
#define OSIMLITE_EXPORT extern "C" __attribute__((visibility("default")))
#else
#define OSIMLITE_EXPORT extern "C"
#endif
#define OSIMLITE_FUNCTION static
#define OSIMLITE_CONSTANT static constexpr

// A tuple whose items all have one type.
template <class T, int N>
struct Array {
    T items[N];
};

// ------------------------------------------------------------------------------------------------ plain numbers
namespace py {

// Python rounds towards minus infinity, and the remainder has the sign of the divisor. Where Python raises an error
// because the divisor is 0, integers give 0 here, and floats what IEEE 754 says.
inline int64_t floor_divide(int64_t a, int64_t b) {
    if (b == 0) return 0;
    if (b == -1) return static_cast<int64_t>(0 - static_cast<uint64_t>(a));
    const int64_t quotient = a / b;
    return a % b != 0 && (a < 0) != (b < 0) ? quotient - 1 : quotient;
}

inline int64_t modulo(int64_t a, int64_t b) {
    if (b == 0 || b == -1) return 0;
    const int64_t rest = a % b;
    return rest != 0 && (rest < 0) != (b < 0) ? rest + b : rest;
}

inline double modulo(double a, double b) {
    const double rest = std::fmod(a, b);
    if (rest == 0.0) return std::copysign(0.0, b);
    return (rest < 0.0) != (b < 0.0) ? rest + b : rest;
}

inline double floor_divide(double a, double b) {
    const double rest = std::fmod(a, b);
    double quotient = (a - rest) / b;
    if (rest != 0.0 && (rest < 0.0) != (b < 0.0)) quotient -= 1.0;
    if (quotient == 0.0) return std::copysign(0.0, a / b);
    const double whole = std::floor(quotient);
    return quotient - whole > 0.5 ? whole + 1.0 : whole;
}

// Products and shifts of integers that keep the lower 64 bits.
inline int64_t multiply(int64_t a, int64_t b) {
    return static_cast<int64_t>(static_cast<uint64_t>(a) * static_cast<uint64_t>(b));
}
inline int64_t shift_left(int64_t a, int64_t b) { return static_cast<int64_t>(static_cast<uint64_t>(a) << b); }

// An integer power of a float is a product, as it is in compiled Python.
inline double power(double base, int64_t exponent) {
    uint64_t rest = exponent < 0 ? 0 - static_cast<uint64_t>(exponent) : static_cast<uint64_t>(exponent);
    if (rest > 0x10000) return std::pow(base, static_cast<double>(exponent));
    double result = 1.0;
    while (rest != 0) {
        if (rest & 1) result *= base;
        rest >>= 1;
        base *= base;
    }
    return exponent < 0 ? 1.0 / result : result;
}

inline int64_t power(int64_t base, int64_t exponent) {
    uint64_t result = 1;
    uint64_t factor = static_cast<uint64_t>(base);
    for (int64_t rest = exponent; rest > 0; rest >>= 1) {
        if (rest & 1) result *= factor;
        factor *= factor;
    }
    return static_cast<int64_t>(result);
}

inline double power(double base, double exponent) { return std::pow(base, exponent); }

// Beyond the range of integers C++ leaves open what comes out; here it is the nearest integer, and 0 for NaN.
inline int64_t to_integer(double x) {
    if (std::fabs(x) < 9223372036854775808.0) return static_cast<int64_t>(x);
    return x > 0.0 ? INT64_MAX : x < 0.0 ? INT64_MIN : 0;
}

inline int64_t abs(int64_t x) { return x < 0 ? static_cast<int64_t>(0 - static_cast<uint64_t>(x)) : x; }
inline double abs(double x) { return std::fabs(x); }
inline double sqrt(double x) { return std::sqrt(x); }
inline double sin(double x) { return std::sin(x); }
inline double cos(double x) { return std::cos(x); }
inline double tan(double x) { return std::tan(x); }
inline double asin(double x) { return std::asin(x); }
inline double acos(double x) { return std::acos(x); }
inline double atan(double x) { return std::atan(x); }
inline double exp(double x) { return std::exp(x); }
inline double log(double x) { return std::log(x); }
inline double sinh(double x) { return std::sinh(x); }
inline double cosh(double x) { return std::cosh(x); }
inline double tanh(double x) { return std::tanh(x); }
inline double erf(double x) { return std::erf(x); }
inline double erfc(double x) { return std::erfc(x); }
inline double radians(double x) { return x * 0.017453292519943295; }
inline double atan2(double y, double x) { return std::atan2(y, x); }
inline double copysign(double x, double sign) { return std::copysign(x, sign); }
inline double floor(double x) { return std::floor(x); }
inline double ceil(double x) { return std::ceil(x); }
inline bool isnan(double x) { return x != x; }
inline bool isfinite(double x) { return std::isfinite(x); }
inline bool isinf(double x) { return std::isinf(x); }

// The first of two numbers unless the second is less or more, as in Python: with NaN the order matters.
template <class T>
inline T min(T a, T b) {
    return b < a ? b : a;
}
template <class T>
inline T max(T a, T b) {
    return b > a ? b : a;
}

// What laws say of numbers with derivatives, where there are none.
inline double strip_derivatives(double x) { return x; }
inline double get_derivative(double, int64_t) { return 0.0; }
inline bool is_exact_zero(double x) { return x == 0.0; }

}  // namespace py

// --------------------------------------------------------------------------------------------------- derivatives
// Derivatives along N directions. Vector types make every operation one or a few instructions; compilers other than
// GCC and Clang take arrays. Their numbers need no more alignment than those of an array, which is what kernels get.
template <int N>
struct SlopeArray {
    double numbers[N];
    double& operator[](int64_t k) { return numbers[k]; }
    double operator[](int64_t k) const { return numbers[k]; }
};

template <int N>
inline SlopeArray<N> operator+(const SlopeArray<N>& a, const SlopeArray<N>& b) {
    SlopeArray<N> sum;
    for (int k = 0; k < N; ++k) sum.numbers[k] = a.numbers[k] + b.numbers[k];
    return sum;
}
template <int N>
inline SlopeArray<N> operator-(const SlopeArray<N>& a, const SlopeArray<N>& b) {
    SlopeArray<N> difference;
    for (int k = 0; k < N; ++k) difference.numbers[k] = a.numbers[k] - b.numbers[k];
    return difference;
}
template <int N>
inline SlopeArray<N> operator-(const SlopeArray<N>& a) {
    SlopeArray<N> negative;
    for (int k = 0; k < N; ++k) negative.numbers[k] = -a.numbers[k];
    return negative;
}
template <int N>
inline SlopeArray<N> operator*(double factor, const SlopeArray<N>& a) {
    SlopeArray<N> product;
    for (int k = 0; k < N; ++k) product.numbers[k] = factor * a.numbers[k];
    return product;
}

template <int N>
struct SlopesOf {
    typedef SlopeArray<N> type;
};

#if defined(__GNUC__) || defined(__clang__)
template <>
struct SlopesOf<2> {
    typedef double type __attribute__((vector_size(16), aligned(8)));
};
template <>
struct SlopesOf<4> {
    typedef double type __attribute__((vector_size(32), aligned(8)));
};
template <>
struct SlopesOf<8> {
    typedef double type __attribute__((vector_size(64), aligned(8)));
};
#if defined(__clang__)
template <>
struct SlopesOf<16> {
    typedef double type __attribute__((vector_size(128), aligned(8)));
};
#else
// GCC passes vectors through memory that are larger than its registers, so that these are divided.
#if defined(__AVX512F__)
typedef double SlopePiece __attribute__((vector_size(64), aligned(8)));
#define OSIMLITE_PIECES(operation) operation(a) operation(b)
struct Slopes16 {
    SlopePiece a, b;
#else
typedef double SlopePiece __attribute__((vector_size(32), aligned(8)));
#define OSIMLITE_PIECES(operation) operation(a) operation(b) operation(c) operation(d)
struct Slopes16 {
    SlopePiece a, b, c, d;
#endif
    double& operator[](int64_t k) { return reinterpret_cast<double*>(this)[k]; }
    double operator[](int64_t k) const { return reinterpret_cast<const double*>(this)[k]; }
};
static OSIMLITE_INLINE Slopes16 operator+(const Slopes16& x, const Slopes16& y) {
    Slopes16 sum;
#define OSIMLITE_ADD(piece) sum.piece = x.piece + y.piece;
    OSIMLITE_PIECES(OSIMLITE_ADD)
    return sum;
}
static OSIMLITE_INLINE Slopes16 operator-(const Slopes16& x, const Slopes16& y) {
    Slopes16 difference;
#define OSIMLITE_SUBTRACT(piece) difference.piece = x.piece - y.piece;
    OSIMLITE_PIECES(OSIMLITE_SUBTRACT)
    return difference;
}
static OSIMLITE_INLINE Slopes16 operator-(const Slopes16& x) {
    Slopes16 negative;
#define OSIMLITE_NEGATE(piece) negative.piece = -x.piece;
    OSIMLITE_PIECES(OSIMLITE_NEGATE)
    return negative;
}
static OSIMLITE_INLINE Slopes16 operator*(double factor, const Slopes16& x) {
    Slopes16 product;
#define OSIMLITE_SCALE(piece) product.piece = factor * x.piece;
    OSIMLITE_PIECES(OSIMLITE_SCALE)
    return product;
}
template <>
struct SlopesOf<16> {
    typedef Slopes16 type;
};
#endif
#endif

// A number with its derivatives along N directions; in memory these follow the number without a gap.
template <int N>
struct Dual {
    typedef typename SlopesOf<N>::type Slopes;
    double value;
    Slopes slopes;

    Dual() = default;
    OSIMLITE_INLINE Dual(double number) : value(number), slopes{} {}
    OSIMLITE_INLINE Dual(double number, const Slopes& change) : value(number), slopes(change) {}

    // The number itself as the direction of this index.
    OSIMLITE_INLINE static Dual along(double number, int64_t direction) {
        Dual result(number);
        result.slopes[direction] = 1.0;
        return result;
    }
};

#define OSIMLITE_DUAL template <int N> static OSIMLITE_INLINE
OSIMLITE_DUAL Dual<N> operator+(const Dual<N>& a) { return a; }
OSIMLITE_DUAL Dual<N> operator-(const Dual<N>& a) { return {-a.value, -1.0 * a.slopes}; }
OSIMLITE_DUAL Dual<N> operator+(const Dual<N>& a, const Dual<N>& b) { return {a.value + b.value, a.slopes + b.slopes}; }
OSIMLITE_DUAL Dual<N> operator+(const Dual<N>& a, double b) { return {a.value + b, a.slopes}; }
OSIMLITE_DUAL Dual<N> operator+(double a, const Dual<N>& b) { return {a + b.value, b.slopes}; }
OSIMLITE_DUAL Dual<N> operator-(const Dual<N>& a, const Dual<N>& b) { return {a.value - b.value, a.slopes - b.slopes}; }
OSIMLITE_DUAL Dual<N> operator-(const Dual<N>& a, double b) { return {a.value - b, a.slopes}; }
OSIMLITE_DUAL Dual<N> operator-(double a, const Dual<N>& b) { return {a - b.value, -b.slopes}; }
OSIMLITE_DUAL Dual<N> operator*(const Dual<N>& a, const Dual<N>& b) {
    return {a.value * b.value, b.value * a.slopes + a.value * b.slopes};
}
OSIMLITE_DUAL Dual<N> operator*(const Dual<N>& a, double b) { return {a.value * b, b * a.slopes}; }
OSIMLITE_DUAL Dual<N> operator*(double a, const Dual<N>& b) { return {a * b.value, a * b.slopes}; }
OSIMLITE_DUAL Dual<N> operator/(const Dual<N>& a, const Dual<N>& b) {
    const double quotient = a.value / b.value;
    return {quotient, (1.0 / b.value) * (a.slopes - quotient * b.slopes)};
}
OSIMLITE_DUAL Dual<N> operator/(const Dual<N>& a, double b) { return {a.value / b, (1.0 / b) * a.slopes}; }
OSIMLITE_DUAL Dual<N> operator/(double a, const Dual<N>& b) {
    const double quotient = a / b.value;
    return {quotient, (1.0 / b.value) * -(quotient * b.slopes)};
}

#define OSIMLITE_IN_PLACE(sign)                                                     \
    template <int N, class Other>                                                   \
    static OSIMLITE_INLINE Dual<N>& operator sign##=(Dual<N>& a, const Other& b) {  \
        a = a sign b;                                                               \
        return a;                                                                   \
    }
OSIMLITE_IN_PLACE(+)
OSIMLITE_IN_PLACE(-)
OSIMLITE_IN_PLACE(*)
OSIMLITE_IN_PLACE(/)

// Comparisons are those of the values.
#define OSIMLITE_COMPARE(sign)                                                                            \
    OSIMLITE_DUAL bool operator sign(const Dual<N>& a, const Dual<N>& b) { return a.value sign b.value; } \
    OSIMLITE_DUAL bool operator sign(const Dual<N>& a, double b) { return a.value sign b; }               \
    OSIMLITE_DUAL bool operator sign(double a, const Dual<N>& b) { return a sign b.value; }
OSIMLITE_COMPARE(<)
OSIMLITE_COMPARE(<=)
OSIMLITE_COMPARE(>)
OSIMLITE_COMPARE(>=)
OSIMLITE_COMPARE(==)
OSIMLITE_COMPARE(!=)

namespace py {

// The rules are those of osimlite/simulation/engines/dual_numbers.py; `x` is the argument and `f` the value. Where a slope
// has no end, at the edge of what a function is defined for, it counts as 0.
#define OSIMLITE_RULE(name, slope)                \
    OSIMLITE_DUAL Dual<N> name(const Dual<N>& a) { \
        const double x = a.value;                 \
        const double f = name(x);                 \
        (void)f;                                  \
        return {f, (slope)*a.slopes};             \
    }
OSIMLITE_RULE(abs, x < 0.0 ? -1.0 : 1.0)
OSIMLITE_RULE(sqrt, x > 0.0 ? 0.5 / f : 0.0)
OSIMLITE_RULE(sin, std::cos(x))
OSIMLITE_RULE(cos, -std::sin(x))
OSIMLITE_RULE(tan, 1.0 + f * f)
OSIMLITE_RULE(asin, std::fabs(x) < 1.0 ? 1.0 / std::sqrt(1.0 - x * x) : 0.0)
OSIMLITE_RULE(acos, std::fabs(x) < 1.0 ? -1.0 / std::sqrt(1.0 - x * x) : 0.0)
OSIMLITE_RULE(atan, 1.0 / (1.0 + x * x))
OSIMLITE_RULE(exp, f)
OSIMLITE_RULE(log, 1.0 / x)
OSIMLITE_RULE(sinh, std::cosh(x))
OSIMLITE_RULE(cosh, std::sinh(x))
OSIMLITE_RULE(tanh, 1.0 - f * f)
OSIMLITE_RULE(erf, 1.1283791670955126 * std::exp(-x * x))
OSIMLITE_RULE(erfc, -1.1283791670955126 * std::exp(-x * x))
OSIMLITE_RULE(radians, 0.017453292519943295)

OSIMLITE_DUAL Dual<N> atan2(const Dual<N>& y, const Dual<N>& x) {
    const double square = x.value * x.value + y.value * y.value;
    return {std::atan2(y.value, x.value), (x.value / square) * y.slopes + (-y.value / square) * x.slopes};
}
OSIMLITE_DUAL Dual<N> atan2(const Dual<N>& y, double x) {
    return {std::atan2(y.value, x), (x / (x * x + y.value * y.value)) * y.slopes};
}
OSIMLITE_DUAL Dual<N> atan2(double y, const Dual<N>& x) {
    return {std::atan2(y, x.value), (-y / (x.value * x.value + y * y)) * x.slopes};
}

// The slope by the second argument is 0, and stays NaN where the derivatives of that have no end.
OSIMLITE_DUAL Dual<N> copysign(const Dual<N>& x, double sign) {
    const double f = std::copysign(x.value, sign);
    return {f, ((x.value < 0.0) == (f < 0.0) ? 1.0 : -1.0) * x.slopes};
}
OSIMLITE_DUAL Dual<N> copysign(const Dual<N>& x, const Dual<N>& sign) {
    const Dual<N> result = copysign(x, sign.value);
    return {result.value, result.slopes + 0.0 * sign.slopes};
}
OSIMLITE_DUAL Dual<N> copysign(double x, const Dual<N>& sign) { return {std::copysign(x, sign.value), 0.0 * sign.slopes}; }

inline double slope_by_base(double x, double y) { return x != 0.0 || y >= 1.0 ? y * std::pow(x, y - 1.0) : 0.0; }
inline double slope_by_exponent(double x, double f) { return x > 0.0 ? f * std::log(x) : 0.0; }
OSIMLITE_DUAL Dual<N> power(const Dual<N>& x, double y) {
    return {std::pow(x.value, y), slope_by_base(x.value, y) * x.slopes};
}
OSIMLITE_DUAL Dual<N> power(const Dual<N>& x, int64_t y) { return power(x, static_cast<double>(y)); }
OSIMLITE_DUAL Dual<N> power(double x, const Dual<N>& y) {
    const double f = std::pow(x, y.value);
    return {f, slope_by_exponent(x, f) * y.slopes};
}
OSIMLITE_DUAL Dual<N> power(const Dual<N>& x, const Dual<N>& y) {
    const double f = std::pow(x.value, y.value);
    return {f, slope_by_base(x.value, y.value) * x.slopes + slope_by_exponent(x.value, f) * y.slopes};
}

OSIMLITE_DUAL Dual<N> modulo(const Dual<N>& x, double y) { return {modulo(x.value, y), x.slopes}; }
OSIMLITE_DUAL Dual<N> modulo(double x, const Dual<N>& y) {
    const double f = modulo(x, y.value);
    return {f, ((f - x) / y.value) * y.slopes};
}
OSIMLITE_DUAL Dual<N> modulo(const Dual<N>& x, const Dual<N>& y) {
    const double f = modulo(x.value, y.value);
    return {f, x.slopes + ((f - x.value) / y.value) * y.slopes};
}

// What has no derivatives takes the value.
OSIMLITE_DUAL int64_t to_integer(const Dual<N>& x) { return to_integer(x.value); }
OSIMLITE_DUAL double floor(const Dual<N>& x) { return std::floor(x.value); }
OSIMLITE_DUAL double ceil(const Dual<N>& x) { return std::ceil(x.value); }
OSIMLITE_DUAL bool isnan(const Dual<N>& x) { return isnan(x.value); }
OSIMLITE_DUAL bool isfinite(const Dual<N>& x) { return isfinite(x.value); }
OSIMLITE_DUAL bool isinf(const Dual<N>& x) { return isinf(x.value); }
OSIMLITE_DUAL double strip_derivatives(const Dual<N>& x) { return x.value; }
OSIMLITE_DUAL double get_derivative(const Dual<N>& x, int64_t direction) { return x.slopes[direction]; }
OSIMLITE_DUAL bool is_exact_zero(const Dual<N>& x) {
    bool result = x.value == 0.0;
    for (int k = 0; k < N; ++k) result = result && x.slopes[k] == 0.0;
    return result;
}

// The derivatives of a root are those that its equation says: a Newton step whose error has no value.
template <class Slope>
static OSIMLITE_INLINE double differentiate_root(double root, double, const Slope&) {
    return root;
}
template <int N, class Slope>
static OSIMLITE_INLINE Dual<N> differentiate_root(const Dual<N>& root, double, const Slope&) {
    return root;
}
template <int N, class Slope>
static OSIMLITE_INLINE Dual<N> differentiate_root(const Dual<N>& root, const Dual<N>& error, const Slope& slope) {
    return {root.value, root.slopes - (1.0 / strip_derivatives(slope)) * error.slopes};
}
template <int N, class Slope>
static OSIMLITE_INLINE Dual<N> differentiate_root(double root, const Dual<N>& error, const Slope& slope) {
    return {root, -((1.0 / strip_derivatives(slope)) * error.slopes)};
}

}  // namespace py
