// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

/// Before a loop over independent elements, or one that adds to `sum` in any order: asks the compiler for vectors.
#define DUCTILE_VECTORISE _Pragma("omp simd")
#define DUCTILE_VECTORISE_SUM _Pragma("omp simd reduction(+ : sum)")
