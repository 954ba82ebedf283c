/* Times CHOLMOD's supernodal Cholesky factorisation with a METIS order on a matrix that `cargo bench --bench
 * factorisation -- --write=FOLDER` wrote: int64 n, int64 nnz, int64 columns[n + 1], int64 rows[nnz], double
 * values[nnz]; lower triangle by columns.
 *
 * Prints, in milliseconds: analysis, factorisation (median of `repeats`), solve (median), and the entries of L.
 *
 *     cc -O2 -o target/peers/cholmod benches/peers/cholmod.c $(pkg-config --cflags suitesparse 2>/dev/null) -lcholmod -lm
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#if __has_include(<suitesparse/cholmod.h>)
#include <suitesparse/cholmod.h>
#else
#include <cholmod.h>
#endif

static double now_ms(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

static int ascending(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *times, int count) {
    qsort(times, (size_t)count, sizeof *times, ascending);
    return times[count / 2];
}

static void read_all(void *to, size_t size, size_t count, FILE *file) {
    if (fread(to, size, count, file) != count) {
        fprintf(stderr, "the matrix file ends early\n");
        exit(2);
    }
}

int main(int argc, char **argv) {
    if (argc < 3) {
        fprintf(stderr, "usage: cholmod MATRIX REPEATS\n");
        return 2;
    }
    FILE *file = fopen(argv[1], "rb");
    int repeats = atoi(argv[2]);
    if (!file || repeats < 1 || repeats > 1000) {
        fprintf(stderr, "%s cannot be opened, or repeats is not between 1 and 1000\n", argv[1]);
        return 2;
    }
    int64_t head[2];
    read_all(head, sizeof(int64_t), 2, file);
    size_t n = (size_t)head[0], nnz = (size_t)head[1];

    cholmod_common common;
    cholmod_start(&common);
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_METIS;
    common.postorder = 1;

    cholmod_sparse *matrix = cholmod_allocate_sparse(n, n, nnz, 1, 1, -1, CHOLMOD_REAL, &common);
    int64_t *wide = malloc((n + 1 + nnz) * sizeof *wide);
    if (!matrix || !wide) return 2;
    read_all(wide, sizeof(int64_t), n + 1 + nnz, file);
    for (size_t i = 0; i <= n; i++) ((int *)matrix->p)[i] = (int)wide[i];
    for (size_t k = 0; k < nnz; k++) ((int *)matrix->i)[k] = (int)wide[n + 1 + k];
    read_all(matrix->x, sizeof(double), nnz, file);
    free(wide);
    fclose(file);

    double *factor_ms = malloc((size_t)repeats * sizeof(double));
    double *solve_ms = malloc((size_t)repeats * sizeof(double));
    cholmod_dense *b = cholmod_ones(n, 1, CHOLMOD_REAL, &common);
    cholmod_dense *x = NULL, *y = NULL, *e = NULL;
    if (!factor_ms || !solve_ms || !b) return 2;

    double start = now_ms();
    cholmod_factor *factor = cholmod_analyze(matrix, &common);
    double analysis_ms = now_ms() - start;
    if (common.selected < 0 || common.method[common.selected].ordering != CHOLMOD_METIS) {
        fprintf(stderr, "CHOLMOD was built without METIS\n");
        return 2;
    }
    for (int k = 0; k < repeats; k++) {
        start = now_ms();
        if (!cholmod_factorize(matrix, factor, &common) || common.status != CHOLMOD_OK) {
            fprintf(stderr, "CHOLMOD found the matrix not positive definite\n");
            return 2;
        }
        factor_ms[k] = now_ms() - start;
    }
    for (int k = 0; k < repeats; k++) {
        start = now_ms();
        cholmod_solve2(CHOLMOD_A, factor, b, NULL, &x, NULL, &y, &e, &common);
        solve_ms[k] = now_ms() - start;
    }
    printf("%.4f %.4f %.4f %zu\n", analysis_ms, median(factor_ms, repeats), median(solve_ms, repeats), factor->xsize);
    return 0;
}
