#pragma once
// Pairs of boxes, one in each word of a vector: the axis along which they are furthest apart, and by it four
// points of one box's face at the other's, or the nearest points of two edges. Sums stay within 16 bits, and
// products are rounded ones of numbers in 2^-15 (../words/words.hpp).
//
// All of this is inlined, because code for AVX2 must not be linked into other code.

#include <array>

#include "sdk/core/predict/rigid/box_words.hpp"
#include "sdk/core/predict/rigid/boxes.hpp"

namespace tandem {

template <class W>
struct RigidBoxes {
  static constexpr std::size_t kWidth = sizeof(W) / sizeof(std::int16_t);

  /// Where something is true: all bits of a word, or none. It is no number.
  struct Mask {
    W bits;

    TANDEM_PART friend Mask operator&(Mask a, Mask b) { return {a.bits & b.bits}; }
    TANDEM_PART friend Mask operator|(Mask a, Mask b) { return {a.bits | b.bits}; }
    TANDEM_INLINE friend Mask operator^(Mask a, Mask b) { return {a.bits ^ b.bits}; }
    TANDEM_PART friend Mask operator~(Mask a) { return {~a.bits}; }
    TANDEM_INLINE W one() const { return W{} - bits; }  // 1 where it is true, or 0
    TANDEM_INLINE bool any() const { return tandem::any(bits); }
  };

  /// Words whose sums saturate.
  struct Word {
    W x;

    TANDEM_INLINE friend Word operator+(Word a, Word b) { return {add_sat16(a.x, b.x)}; }
    TANDEM_INLINE friend Word operator-(Word a, Word b) { return {sub_sat16(a.x, b.x)}; }
    TANDEM_INLINE friend Word mul_q15(Word a, Word b) { return {tandem::mul_q15(a.x, b.x)}; }
    TANDEM_INLINE friend Word operator-(Word a) { return Word{W{}} - a; }
    TANDEM_PART friend Mask operator<(Word a, Word b) { return {W(a.x < b.x)}; }
  };
  using Vec = std::array<Word, 3>;
  using Matrix = std::array<Vec, 3>;

  TANDEM_INLINE static Word constant_of(int x) { return {W{} + static_cast<std::int16_t>(x)}; }
  TANDEM_PART static Word select(Mask where, Word yes, Word no) { return {chosen(where.bits, yes.x, no.x)}; }
  TANDEM_PART static Vec select(Mask where, const Vec& yes, const Vec& no) {
    return {select(where, yes[0], no[0]), select(where, yes[1], no[1]), select(where, yes[2], no[2])};
  }
  TANDEM_PART static Word smaller(Word a, Word b) { return {a.x < b.x ? a.x : b.x}; }
  TANDEM_PART static Word greater(Word a, Word b) { return {a.x > b.x ? a.x : b.x}; }
  TANDEM_INLINE static Word magnitude(Word a) { return greater(a, -a); }
  TANDEM_PART static Word within(Word a, Word most) { return greater(smaller(a, most), -most); }
  TANDEM_PART static Word negated(Mask where, Word a) { return select(where, -a, a); }
  TANDEM_PART static Word kept(Mask where, Word a) { return {where.bits & a.x}; }  // 0 elsewhere
  TANDEM_INLINE static Word twice(Word a) { return a + a; }
  TANDEM_INLINE static Word fourfold(Word a) { return twice(twice(a)); }
  TANDEM_LARGE static Word dot(const Vec& a, const Vec& b) {
    return mul_q15(a[0], b[0]) + mul_q15(a[1], b[1]) + mul_q15(a[2], b[2]);
  }
  TANDEM_PART static Vec sum(const Vec& a, const Vec& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
  TANDEM_PART static Vec difference(const Vec& a, const Vec& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  }
  TANDEM_PART static Vec scaled(const Vec& a, Word x) {
    return {mul_q15(a[0], x), mul_q15(a[1], x), mul_q15(a[2], x)};
  }
  /// The sum of axes, each times a component of x.
  TANDEM_INLINE static Vec in_world(const Matrix& axes, const Vec& x) {
    return sum(sum(scaled(axes[0], x[0]), scaled(axes[1], x[1])), scaled(axes[2], x[2]));
  }
  /// Of three things the one of index 0, 1 or 2, then the next two.
  struct Choice {
    Mask is1, is2;
    template <class T>
    TANDEM_INLINE std::array<T, 3> of(const std::array<T, 3>& x) const {
      return {select(is2, x[2], select(is1, x[1], x[0])), select(is2, x[0], select(is1, x[2], x[1])),
              select(is2, x[1], select(is1, x[0], x[2]))};
    }
  };
  /// The first of the greatest.
  TANDEM_INLINE static Choice greatest(const Vec& x) {
    const Mask is1 = x[0] < x[1];
    const Mask is2 = greater(x[0], x[1]) < x[2];
    return {is1 & ~is2, is2};
  }

  struct Box {
    Matrix axes;
    Vec size;
    Word radius, scale, inverse;
  };
  struct Pair {
    Box a, b;
    Vec d;
    Word margin;
    Matrix cosine;   // of a's axis i and b's j
    Vec in_a, in_b;  // d in their frames
    Word smallest;   // of their sizes
  };
  // What touches of 16 pairs: four points of faces, or one of edges.
  struct Points {
    Vec n;
    std::array<Word, 4> gap;
    std::array<Mask, 4> is;
    std::array<Vec, 4> at;  // from a's centre
  };

  static constexpr std::size_t kCandidates = 12;  // of the points of a pair

  // Word i of record k is word k of x[i], and the other way round. Three times each row and the fourth from
  // it, zipped, are a transposition.
  TANDEM_LARGE static std::array<W, 8> transposed(std::array<W, 8> x) {
    for (int round = 0; round < 3; ++round) {
      std::array<W, 8> y;
      for (std::size_t k = 0; k < 4; ++k) {
        y[2 * k] = low_zip(x[k], x[k + 4]);
        y[2 * k + 1] = high_zip(x[k], x[k + 4]);
      }
      x = y;
    }
    return x;
  }
  // Eight words of each of kWidth records.
  TANDEM_INLINE static std::array<W, 8> read_records(const std::int16_t* const* records) {
    std::array<W, 8> x;
    if constexpr (kWidth == 1) {
      for (std::size_t k = 0; k < 8; ++k) x[k] = W{records[0][k]};
      return x;
    } else {
      for (std::size_t k = 0; k < 8; ++k) read_eights(x[k], records[k], records[k + kWidth - 8]);
      return transposed(x);
    }
  }
  template <class Record>
  TANDEM_INLINE static void write_records(Record* records, const std::array<W, 8>& x) {
    static_assert(sizeof(Record) == sizeof(EightWords));
    if constexpr (kWidth == 1) {
      write(records, x);
    } else {
      const std::array<W, 8> y = transposed(x);
      for (std::size_t k = 0; k < 8; ++k) write_eights(records + k, records + k + kWidth - 8, y[k]);
    }
  }
  TANDEM_INLINE static Box read_box(const std::int16_t** records) {
    const std::array<W, 8> x = read_records(records);
    for (std::size_t k = 0; k < kWidth; ++k) records[k] += 8;
    const std::array<W, 8> y = read_records(records);
    return {{{{{{x[0]}, {x[1]}, {x[2]}}}, {{{x[3]}, {x[4]}, {x[5]}}}, {{{x[6]}, {x[7]}, {y[0]}}}}},
            {{{y[1]}, {y[2]}, {y[3]}}},
            {y[4]},
            {y[5]},
            {y[6]}};
  }
  TANDEM_LARGE static Pair read_pair(const RigidBoxPair* pairs, const RigidSolidWords* solids) {
    const std::int16_t *of_a[kWidth], *of_b[kWidth], *of_pair[kWidth];
    for (std::size_t k = 0; k < kWidth; ++k) {
      of_a[k] = &solids[pairs[k].a].axes[0][0];
      of_b[k] = &solids[pairs[k].b].axes[0][0];
      of_pair[k] = pairs[k].d;
    }
    const std::array<W, 8> x = read_records(of_pair);
    Pair pair{};
    pair.a = read_box(of_a);
    pair.b = read_box(of_b);
    pair.d = {{{x[0]}, {x[1]}, {x[2]}}};
    pair.margin = {x[3]};
    for (std::size_t i = 0; i < 3; ++i) {
      pair.in_a[i] = dot(pair.a.axes[i], pair.d);
      pair.in_b[i] = dot(pair.b.axes[i], pair.d);
      for (std::size_t j = 0; j < 3; ++j)
        pair.cosine[i][j] = within(dot(pair.a.axes[i], pair.b.axes[j]), constant_of(0x7FFF));
    }
    const Vec& x_a = pair.a.size;
    const Vec& x_b = pair.b.size;
    pair.smallest =
        smaller(smaller(smaller(x_a[0], x_a[1]), smaller(x_a[2], x_b[0])), smaller(x_b[1], x_b[2]));
    return pair;
  }

  TANDEM_PART static Vec magnitudes(const Vec& x) {
    return {magnitude(x[0]), magnitude(x[1]), magnitude(x[2])};
  }
  // How far the other box is from each pair of faces of this one; `cosine[i][j]` is that between its axis i
  // and the other's axis j.
  TANDEM_INLINE static Vec apart_by_faces(const Vec& in_one, const Vec& size, const Vec& other,
                                          const Matrix& cosine) {
    Vec apart{};
    for (std::size_t i = 0; i < 3; ++i)
      apart[i] = magnitude(in_one[i]) - size[i] - dot(other, magnitudes(cosine[i]));
    return apart;
  }
  TANDEM_INLINE static Matrix turned(const Matrix& m) {
    return {{{m[0][0], m[1][0], m[2][0]}, {m[0][1], m[1][1], m[2][1]}, {m[0][2], m[1][2], m[2][2]}}};
  }

  // The two edges along whose axis the boxes are furthest apart.
  struct Edges {
    Word apart, i, j;
    Word per_sine;  // in 2^-13
    Word side;
  };
  TANDEM_LARGE static Word inverse_root(Word y) {
    Word r = constant_of(23777) - mul_q15(y, constant_of(18115));
    for (int step = 0; step < 3; ++step)
      r = twice(mul_q15(r, fourfold(constant_of(3 << 11) - mul_q15(mul_q15(y, r), r))));
    return r;
  }
  TANDEM_INLINE static Edges best_edges(const Pair& pair) {
    constexpr std::size_t kNext[3] = {1, 2, 0}, kLast[3] = {2, 0, 1};
    Edges best{constant_of(-0x7FFF), {}, {}, {}, {}};
    Matrix cosine{};
    for (std::size_t i = 0; i < 3; ++i) cosine[i] = magnitudes(pair.cosine[i]);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t i1 = kNext[i];
      const std::size_t i2 = kLast[i];
      for (std::size_t j = 0; j < 3; ++j) {
        const std::size_t j1 = kNext[j];
        const std::size_t j2 = kLast[j];
        const Word side =
            mul_q15(pair.in_a[i2], pair.cosine[i1][j]) - mul_q15(pair.in_a[i1], pair.cosine[i2][j]);
        const Word both = mul_q15(pair.a.size[i1], cosine[i2][j]) + mul_q15(pair.a.size[i2], cosine[i1][j]) +
                          mul_q15(pair.b.size[j1], cosine[i][j2]) + mul_q15(pair.b.size[j2], cosine[i][j1]);
        const Word square = constant_of(0x7FFF) - mul_q15(cosine[i][j], cosine[i][j]);
        const Word per_sine = inverse_root(square);
        const Word apart = mul_q15(fourfold(magnitude(side) - both), per_sine);
        const Mask better = (best.apart < apart) & (constant_of(kLeastSquare - 1) < square);
        best.apart = select(better, apart, best.apart);
        best.per_sine = select(better, per_sine, best.per_sine);
        best.side = select(better, side, best.side);
        best.i = select(better, constant_of(static_cast<int>(i)), best.i);
        best.j = select(better, constant_of(static_cast<int>(j)), best.j);
      }
    }
    return best;
  }
  TANDEM_INLINE static Choice choice_of(Word index) {
    return {(constant_of(0) < index) & (index < constant_of(2)), constant_of(1) < index};
  }

  TANDEM_INLINE static void touch_edges(const Pair& pair, const Edges& edges, Points& points) {
    const Choice i = choice_of(edges.i);
    const Choice j = choice_of(edges.j);
    const Matrix a = i.of(pair.a.axes);
    const Matrix b = j.of(pair.b.axes);
    const Vec size_a = i.of(pair.a.size);
    const Vec size_b = j.of(pair.b.size);
    const Matrix c = i.of(Matrix{j.of(pair.cosine[0]), j.of(pair.cosine[1]), j.of(pair.cosine[2])});
    const Mask flip = constant_of(0) < edges.side;
    for (std::size_t m = 0; m < 3; ++m) {
      const std::size_t m1 = m == 2 ? 0 : m + 1;
      const std::size_t m2 = m1 == 2 ? 0 : m1 + 1;
      const Word n = mul_q15(mul_q15(a[0][m1], b[0][m2]) - mul_q15(a[0][m2], b[0][m1]), edges.per_sine);
      points.n[m] = {(negated(flip, n) + constant_of(1)).x >> 1};
    }
    // Which way the normal goes along the other axes of both.
    const auto on = [&](Word size, Word cosine) {
      return negated(constant_of(0) < negated(flip, cosine), size);
    };
    const Vec start = sum(scaled(a[1], on(size_a[1], -c[2][0])), scaled(a[2], on(size_a[2], c[1][0])));
    const Vec end = sum(scaled(b[1], on(size_b[1], -c[0][2])), scaled(b[2], on(size_b[2], c[0][1])));
    const Vec between = difference(sum(end, pair.d), start);
    const Word along = dot(a[0], between) - mul_q15(c[0][0], dot(b[0], between));
    const Word place =
        within(mul_q15(fourfold(mul_q15(fourfold(along), edges.per_sine)), edges.per_sine), size_a[0]);
    points.at[0] = sum(start, scaled(a[0], place));
    points.gap[0] = edges.apart;
  }

  // 1 / z of 1/2 < z <= 1, in 2^-14.
  TANDEM_INLINE static Word inverse(Word z) {
    Word r = constant_of(1 << 14) + (constant_of(27058) - mul_q15(z, constant_of(27705)));
    for (int step = 0; step < 2; ++step) r = twice(mul_q15(r, constant_of(0x7FFF) - mul_q15(z, r)));
    return r;
  }

  // A quotient of numbers of 0 or more.
  struct Quotient {
    Word x, y;
  };
  TANDEM_INLINE static Quotient chosen_of(const Quotient& a, const Quotient& b, Mask is_b) {
    return {select(is_b, b.x, a.x), select(is_b, b.y, a.y)};
  }
  TANDEM_PART static Mask less(const Quotient& a, const Quotient& b) {
    return {less_product(a.x.x, b.y.x, b.x.x, a.y.x)};
  }

  // What of the four edges between the corners of a face is within the face of the other box: where each
  // begins, and where it ends, if that is no corner. No corner is beyond two opposite sides, so an edge
  // enters and leaves by at most one of them, and of both directions only the later entry and the sooner exit
  // are divided.
  TANDEM_INLINE static void cut_edges(const std::array<Vec, 4>& corners, const Vec& half, Vec* x, Mask* is) {
    Word beyond[4][4];
    for (std::size_t m = 0; m < 4; ++m) {
      for (std::size_t i = 0; i < 2; ++i) {
        beyond[m][2 * i] = corners[m][1 + i] - half[1 + i];
        beyond[m][2 * i + 1] = -corners[m][1 + i] - half[1 + i];
      }
    }
    const Word zero{};
    const Word least = constant_of(1);
    for (std::size_t m = 0; m < 4; ++m) {
      const std::size_t next = m == 3 ? 0 : m + 1;
      Mask none{};
      Quotient entry[2], exit[2];
      for (std::size_t i = 0; i < 2; ++i) {
        const Word* const one = &beyond[m][2 * i];
        const Word* const other = &beyond[next][2 * i];
        const Mask enters = zero < one[0];
        const Mask leaves = zero < other[0];
        const Mask leaves_below = zero < other[1];
        none = none | (enters & leaves) | ((zero < one[1]) & leaves_below);
        entry[i].x = greater(greater(one[0], one[1]), zero);
        entry[i].y = greater(entry[i].x + magnitude(select(enters, other[0], other[1])), least);
        exit[i].x = select(leaves, magnitude(one[0]), select(leaves_below, magnitude(one[1]), least));
        exit[i].y = exit[i].x + greater(greater(other[0], other[1]), zero);
      }
      const Word begin = fraction(chosen_of(entry[0], entry[1], less(entry[0], entry[1])));
      const Word end = fraction(chosen_of(exit[0], exit[1], less(exit[1], exit[0])));
      const Vec edge = difference(corners[next], corners[m]);
      is[2 * m] = ~(none | (end < begin));
      is[2 * m + 1] = is[2 * m] & (end < constant_of(0x7FFF));
      x[2 * m] = sum(corners[m], scaled(edge, begin));
      x[2 * m + 1] = sum(corners[m], scaled(edge, end));
    }
  }
  // (x * 2^15) / y, rounded down, at most 2^15 - 1, for x <= y and y > 0: bit by bit. What is left after a
  // bit is the lesser of twice the rest and of that less y, because the latter wraps if it is below 0.
  TANDEM_LARGE static Word fraction(const Quotient& of) {
    using Halves = typename WordLanes<W>::Halves;
    const Halves y = reinterpret_cast<Halves>(of.y.x);
    Halves rest = reinterpret_cast<Halves>(of.x.x);
    W q{};
    for (int bit = 0; bit < 15; ++bit) {
      const Halves twice_rest = rest + rest;
      const Halves less_y = twice_rest - y;
      rest = less_y < twice_rest ? less_y : twice_rest;
      q = q + q + Mask{W(rest == less_y)}.one();
    }
    return {q};
  }

  // The lowest, then three times that which is the furthest from those chosen, if it is not near.
  TANDEM_INLINE static std::array<Vec, 4> most_important(const std::array<Vec, kCandidates>& x,
                                                         const std::array<Mask, kCandidates>& is, Word near,
                                                         std::array<Mask, 4>& is_one) {
    std::array<Vec, 4> best{};
    std::array<Word, kCandidates> far;
    Word lowest = constant_of(0x7FFF);
    for (std::size_t m = 0; m < kCandidates; ++m) {
      const Mask lower = is[m] & (x[m][0] < lowest);
      lowest = select(lower, x[m][0], lowest);
      best[0] = select(lower, x[m], best[0]);
      is_one[0] = is_one[0] | lower;
      far[m] = kept(is[m], constant_of(0x7FFF));
    }
    for (std::size_t k = 1; k < best.size(); ++k) {
      Word furthest = near;
      for (std::size_t m = 0; m < kCandidates; ++m) {
        const Vec& last = best[k - 1];
        far[m] = smaller(far[m], magnitude(x[m][1] - last[1]) + magnitude(x[m][2] - last[2]));
        const Mask further = furthest < far[m];
        furthest = select(further, far[m], furthest);
        best[k] = select(further, x[m], best[k]);
        is_one[k] = is_one[k] | further;
      }
    }
    return best;
  }

  // By the face of `one` of the index k, with that face of the other that looks at it. `d`: from one's centre
  // to the other's, in one's frame. All vectors that follow begin with the component along the normal.
  TANDEM_INLINE static void touch_faces(const Pair& pair, Mask by_b, const Choice& k, Points& points) {
    const Vec half = k.of(select(by_b, pair.b.size, pair.a.size));
    const Vec d = k.of(select(by_b, Vec{-pair.in_b[0], -pair.in_b[1], -pair.in_b[2]}, pair.in_a));
    const Matrix across = turned(pair.cosine);
    Matrix c = k.of(Matrix{select(by_b, across[0], pair.cosine[0]), select(by_b, across[1], pair.cosine[1]),
                           select(by_b, across[2], pair.cosine[2])});
    const Choice j = greatest(magnitudes(c[0]));
    const Vec other = j.of(select(by_b, pair.a.size, pair.b.size));
    for (Vec& row : c) row = j.of(row);
    const Mask inwards = d[0] < constant_of(0);
    for (Word& x : c[0]) x = negated(inwards, x);
    const Mask away = constant_of(0) < c[0][0];
    for (Vec& row : c) row[0] = negated(away, row[0]);
    const Matrix column = turned(c);
    const Vec middle = sum({magnitude(d[0]), d[1], d[2]}, scaled(column[0], other[0]));
    const Vec one = scaled(column[1], other[1]);
    const Vec two = scaled(column[2], other[2]);
    const Word per = inverse(-c[0][0]);
    const Word slope_u = mul_q15(c[1][0], per);
    const Word slope_v = mul_q15(c[2][0], per);
    std::array<Vec, kCandidates> x;  // along the normal, and across: of the other's edges, and one's corners
    std::array<Mask, kCandidates> is;
    cut_edges({sum(sum(middle, one), two), sum(difference(middle, one), two),
               difference(difference(middle, one), two), difference(sum(middle, one), two)},
              half, x.data(), is.data());
    for (std::size_t m = 0; m < 4; ++m) {
      const Word u = m == 0 || m == 3 ? half[1] : -half[1];
      const Word v = m < 2 ? half[2] : -half[2];
      const Vec flat = {Word{}, u - middle[1], v - middle[2]};
      const Word up = mul_q15(twice(flat[1]), slope_u) + mul_q15(twice(flat[2]), slope_v);
      const Vec way = {up, flat[1], flat[2]};
      x[8 + m] = {middle[0] + up, u, v};
      is[8 + m] = ~(other[1] < magnitude(dot(column[1], way))) & ~(other[2] < magnitude(dot(column[2], way)));
    }
    for (std::size_t m = 0; m < kCandidates; ++m) {
      x[m][0] = x[m][0] - half[0];
      is[m] = is[m] & (x[m][0] < pair.margin);
    }
    const std::array<Vec, 4> important = most_important(x, is, {pair.smallest.x >> kNearShift}, points.is);
    const Matrix axes = k.of(Matrix{select(by_b, pair.b.axes[0], pair.a.axes[0]),
                                    select(by_b, pair.b.axes[1], pair.a.axes[1]),
                                    select(by_b, pair.b.axes[2], pair.a.axes[2])});
    const Mask flip = ~(by_b ^ inwards);
    for (std::size_t m = 0; m < 3; ++m) points.n[m] = {(negated(flip, axes[0][m]) + constant_of(4)).x >> 3};
    const Vec to_one = {kept(by_b, pair.d[0]), kept(by_b, pair.d[1]), kept(by_b, pair.d[2])};
    for (std::size_t m = 0; m < 4; ++m) {
      const auto& [gap, u, v] = important[m];
      points.gap[m] = gap;
      points.at[m] = sum(to_one, in_world(axes, {negated(inwards, gap + half[0]), u, v}));
    }
  }

  TANDEM_INLINE static Word arm(const Box& box, Word at) {
    const W inside = within(at, box.radius).x * box.scale.x;
    return mul_q15(Word{inside}, box.inverse);
  }

  // How far pairs are apart by the faces of a and of b.
  struct Faces {
    Vec of_a, of_b;
    Word best_a, best_b;
  };
  TANDEM_LARGE static Faces faces_of(const Pair& pair) {
    const Vec a = apart_by_faces(pair.in_a, pair.a.size, pair.b.size, pair.cosine);
    const Vec b = apart_by_faces(pair.in_b, pair.b.size, pair.a.size, turned(pair.cosine));
    return {a, b, greater(greater(a[0], a[1]), a[2]), greater(greater(b[0], b[1]), b[2])};
  }

  /// Implements RigidPairKernels::keep_near.
  TANDEM_INLINE static std::size_t keep_near(RigidBoxPair* pairs, std::size_t count,
                                             const RigidSolidWords* solids) {
    std::size_t kept = 0;
    for (std::size_t first = 0; first < count; first += kWidth) {
      const Pair pair = read_pair(pairs + first, solids);
      const Faces faces = faces_of(pair);
      std::int16_t is[kWidth];
      write(is, (greater(faces.best_a, faces.best_b) < pair.margin).bits);
      for (std::size_t k = 0; k < kWidth; ++k) {
        pairs[kept] = pairs[first + k];
        kept += is[k] != 0 ? 1 : 0;
      }
    }
    return kept;
  }

  /// Implements RigidPairKernels::touch_boxes for kWidth pairs, whose words are those from `first` on in
  /// `out`.
  TANDEM_INLINE static void touch(const RigidBoxPair* pairs, const RigidSolidWords* solids, std::size_t first,
                                  RigidBoxPoints& out) {
    const Pair pair = read_pair(pairs + first, solids);
    const auto [of_a, of_b, face_a, face_b] = faces_of(pair);
    const Mask nearly = greater(face_a, face_b) < pair.margin;
    const Edges edges = best_edges(pair);
    const Mask near = nearly & (edges.apart < pair.margin);
    if (!near.any()) {
      write_records(out.pairs + first, {});
      return;
    }
    const Mask by_b = face_a + Word{pair.smallest.x >> kFaceShift} < face_b;
    Points points{};
    touch_faces(pair, by_b, greatest(select(by_b, of_b, of_a)), points);
    const Word face = select(by_b, face_b, face_a);
    const Mask by_edges = face + mul_q15(pair.smallest, constant_of(kEdgePart)) < edges.apart;
    if ((by_edges & near).any()) {
      Points of_edges{};
      touch_edges(pair, edges, of_edges);
      points.n = select(by_edges, of_edges.n, points.n);
      points.at[0] = select(by_edges, of_edges.at[0], points.at[0]);
      points.gap[0] = select(by_edges, of_edges.gap[0], points.gap[0]);
      points.is[0] = points.is[0] | by_edges;
      for (std::size_t m = 1; m < 4; ++m) points.is[m] = points.is[m] & ~by_edges;
    }
    Word count{};
    for (std::size_t m = 0; m < 4; ++m) {
      count.x = count.x + (points.is[m] & near).one();
      std::array<W, 8> x{};
      for (std::size_t i = 0; i < 3; ++i) {
        x[i] = arm(pair.a, points.at[m][i]).x;
        x[3 + i] = arm(pair.b, points.at[m][i] - pair.d[i]).x;
      }
      x[6] = points.gap[m].x;
      write_records(out.points[m] + first, x);
    }
    write_records(out.pairs + first, {points.n[0].x, points.n[1].x, points.n[2].x, count.x});
  }

  /// Numbers of idl/PROTOCOL.md.
  static constexpr int kLeastSquare = 1 << 11;  // of the sine of edges that make an axis, in 2^-15
  static constexpr int kFaceShift = 9, kNearShift = 4;
  static constexpr int kEdgePart = 655;
};

}  // namespace tandem
