/* SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
 * SPDX-License-Identifier: Apache-2.0
 *
 * The pose along a path in one call: Path.pose_at of path.py, which loads it.
 *
 * Python is the specification. Each function here names the one that it repeats, and returns the
 * same to the last bit, so the order of all operations matters. What is not the common case, and
 * every error, is left to Python: to the method sample() of the edge.
 *
 * use() finds the slots that are read here, so a class that changes is noticed at import. Whoever
 * changes what these functions return raises REVISION, here and in path.py, so that an older build
 * is noticed, too. All of this runs with the GIL; and with the buffer's lock, or in a reader of a
 * shared tree, in which the histories may change between the edges: see shared/mirror.py.
 */
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <structmember.h>
#include <float.h>
#include <math.h>
#include <stdint.h>

#ifdef Py_GIL_DISABLED
#error "This relies on the GIL"
#endif
#if FLT_EVAL_METHOD != 0
#error "These numbers would have other roundings than Python's"
#endif

#define REVISION 1
#define HALF_TURN 1e-15  /* geometry/chain.py */
#define POSE_FLOATS 7

typedef struct { double x, y, z, qx, qy, qz, qw; } Pose;

static PyTypeObject *static_type, *samples_type;
static PyObject *name_of_sample;
/* Where the slots of these two classes are in an object. */
static struct Slots {
    Py_ssize_t pose, stamps, poses, parents, horizon, is_linear;
} slots;

static PyObject *at(PyObject *object, Py_ssize_t slot)
{
    return *(PyObject **)((char *)object + slot);
}

static int read_integer(PyObject *object, int64_t *number)
{
    int overflow;
    if (object == NULL || !PyLong_CheckExact(object))
        return 0;
    *number = PyLong_AsLongLongAndOverflow(object, &overflow);
    return !overflow;
}

static int read_tuple(PyObject *tuple, Pose *pose)
{
    double *numbers = (double *)pose;
    if (tuple == NULL || !PyTuple_Check(tuple) || PyTuple_GET_SIZE(tuple) != POSE_FLOATS)
        return 0;
    for (Py_ssize_t i = 0; i < POSE_FLOATS; i++) {
        PyObject *number = PyTuple_GET_ITEM(tuple, i);
        if (!PyFloat_CheckExact(number))
            return 0;
        numbers[i] = PyFloat_AS_DOUBLE(number);
    }
    return 1;
}

/* geometry/chain.py: between_samples, with slerp_weights(cosine, ratio, as_tf2=True) in it */
static int between_samples(const char *pair, int64_t stamp, int64_t first, int64_t last,
                           Pose *pose)
{
    Pose a, b;
    memcpy(&a, pair, sizeof a);
    memcpy(&b, pair + sizeof a, sizeof b);
    double cosine = a.qx * b.qx + a.qy * b.qy + a.qz * b.qz + a.qw * b.qw;
    if (-HALF_TURN < cosine && cosine < HALF_TURN)
        return 0;
    /* The difference of two stamps may have 64 bits without a sign. */
    double ratio = (double)((uint64_t)stamp - (uint64_t)first)
        / (double)((uint64_t)last - (uint64_t)first);
    double left = 1.0 - ratio, one = 1.0, other = 0.0, absolute = fabs(cosine);
    if (absolute < 1.0) {
        double angle = acos(absolute);
        other = sin(ratio * angle) / sin(angle);
        one = cos(ratio * angle) - absolute * other;
        if (!(cosine >= 0.0))
            other = -other;
    }
    *pose = (Pose){
        left * a.x + ratio * b.x, left * a.y + ratio * b.y, left * a.z + ratio * b.z,
        one * a.qx + other * b.qx, one * a.qy + other * b.qy, one * a.qz + other * b.qz,
        one * a.qw + other * b.qw};
    return 1;
}

/* The memory of a file need not be aligned. */
static int64_t stamp_at(const char *stamps, Py_ssize_t index)
{
    int64_t stamp;
    memcpy(&stamp, stamps + index * (Py_ssize_t)sizeof stamp, sizeof stamp);
    return stamp;
}

/* edges/samples.py: Samples.sample, of a stamp between two samples, or of one of them */
static int find(const char *stamps, Py_ssize_t count, const char *poses, int64_t stamp,
                int64_t horizon, Pose *pose)
{
    if (count == 0)
        return 0;
    /* bisect_right; without branches in the loop, because no processor could predict them */
    int is_last = stamp >= stamp_at(stamps, count - 1);
    Py_ssize_t after = is_last ? count : 0, end = count;
    while (after < end) {
        Py_ssize_t middle = after + (end - after) / 2;
        int is_newer = stamp < stamp_at(stamps, middle);
        end = is_newer ? middle : end;
        after = is_newer ? after : middle + 1;
    }
    if (after == 0)
        return 0;
    int64_t older = stamp_at(stamps, after - 1);
    const char *pair = poses + (after - 1) * (Py_ssize_t)sizeof *pose;
    if (older < horizon || (older != stamp && after == count))
        return 0;
    if (older != stamp)
        return between_samples(pair, stamp, older, stamp_at(stamps, after), pose);
    memcpy(pose, pair, sizeof *pose);
    return 1;
}

/* Give access to the memory of an array or a memoryview; 0 if it is none. */
static int view(PyObject *memory, Py_buffer *buffer)
{
    Py_XINCREF(memory);  /* a buffer of a class in Python could drop it meanwhile */
    int done = memory != NULL && PyObject_GetBuffer(memory, buffer, PyBUF_SIMPLE) == 0;
    Py_XDECREF(memory);
    PyErr_Clear();
    return done;
}

/* edges/samples.py: Samples.sample; 0 in all cases that it is better at */
static int sample_moving(PyObject *edge, int64_t stamp, Pose *pose)
{
    int64_t horizon;
    Py_buffer stamps, poses;
    int found = 0;
    if (at(edge, slots.is_linear) != Py_True || at(edge, slots.parents) != Py_None
            || !read_integer(at(edge, slots.horizon), &horizon)
            || !view(at(edge, slots.stamps), &stamps))
        return 0;
    if (view(at(edge, slots.poses), &poses)) {
        Py_ssize_t count = stamps.len / (Py_ssize_t)sizeof stamp;
        if (poses.len == count * (Py_ssize_t)sizeof *pose)
            found = find(stamps.buf, count, poses.buf, stamp, horizon, pose);
        PyBuffer_Release(&poses);
    }
    PyBuffer_Release(&stamps);
    return found;
}

/* The method sample() of an edge. Return 0 if its result is not seven floats, -1 if it raised. */
static int sample(PyObject *edge, PyObject *when, int64_t stamp, Pose *pose)
{
    if (Py_IS_TYPE(edge, samples_type) && sample_moving(edge, stamp, pose))
        return 1;
    if (Py_IS_TYPE(edge, static_type))
        return read_tuple(at(edge, slots.pose), pose);
    if (PyTuple_CheckExact(edge))  /* a pose that the caller has */
        return read_tuple(edge, pose);
    PyObject *sampled = PyObject_CallMethodObjArgs(edge, name_of_sample, when, NULL);
    if (sampled == NULL)
        return -1;
    int is_plain = read_tuple(sampled, pose);
    Py_DECREF(sampled);
    return is_plain;
}

/* geometry/chain.py: one step of compose_chain */
static Pose compose(const Pose *a, const Pose *b)
{
    double cx = a->qy * b->z - a->qz * b->y;
    double cy = a->qz * b->x - a->qx * b->z;
    double cz = a->qx * b->y - a->qy * b->x;
    cx += cx, cy += cy, cz += cz;
    return (Pose){
        a->x + (b->x + a->qw * cx + a->qy * cz - a->qz * cy),
        a->y + (b->y + a->qw * cy + a->qz * cx - a->qx * cz),
        a->z + (b->z + a->qw * cz + a->qx * cy - a->qy * cx),
        a->qw * b->qx + a->qx * b->qw + a->qy * b->qz - a->qz * b->qy,
        a->qw * b->qy - a->qx * b->qz + a->qy * b->qw + a->qz * b->qx,
        a->qw * b->qz + a->qx * b->qy - a->qy * b->qx + a->qz * b->qw,
        a->qw * b->qw - a->qx * b->qx - a->qy * b->qy - a->qz * b->qz};
}

/* geometry/chain.py: inverse */
static Pose inverse(const Pose *p)
{
    double cx = 2.0 * (p->qy * p->z - p->qz * p->y);
    double cy = 2.0 * (p->qz * p->x - p->qx * p->z);
    double cz = 2.0 * (p->qx * p->y - p->qy * p->x);
    return (Pose){-p->x + p->qw * cx - p->qy * cz + p->qz * cy,
                  -p->y + p->qw * cy - p->qz * cx + p->qx * cz,
                  -p->z + p->qw * cz - p->qx * cy + p->qy * cx,
                  -p->qx, -p->qy, -p->qz, p->qw};
}

/* geometry/chain.py: compose_chain of the samples of a branch; the result is that of sample() */
static int follow(PyObject *edges, PyObject *when, int64_t stamp, Pose *pose)
{
    *pose = (Pose){0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0};
    for (Py_ssize_t i = 0; i < PyTuple_GET_SIZE(edges); i++) {
        Pose next;
        int done = sample(PyTuple_GET_ITEM(edges, i), when, stamp, &next);
        if (done <= 0)
            return done;
        *pose = i == 0 ? next : compose(pose, &next);
    }
    return 1;
}

/* path.py: Path.pose_at, and geometry/chain.py: join_branches */
static PyObject *pose_at(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    int64_t stamp;
    Pose down, up;
    if (count != 3 || samples_type == NULL || !PyTuple_Check(args[0]) || !PyTuple_Check(args[1])) {
        PyErr_SetString(PyExc_TypeError, "pose_at(down, up, stamp) takes two tuples, after use()");
        return NULL;
    }
    int done = read_integer(args[2], &stamp) ? follow(args[0], args[2], stamp, &down) : 0;
    if (done > 0)
        done = follow(args[1], args[2], stamp, &up);
    if (done == 0)
        Py_RETURN_NONE;
    if (done < 0)
        return NULL;
    if (PyTuple_GET_SIZE(args[1]) > 0) {
        up = inverse(&up);
        down = compose(&up, &down);
    }
    return Py_BuildValue("(ddddddd)", down.x, down.y, down.z, down.qx, down.qy, down.qz, down.qw);
}

static int find_slot(PyTypeObject *type, const char *name, Py_ssize_t *slot)
{
    PyObject *descriptor = PyObject_GetAttrString((PyObject *)type, name);
    if (descriptor == NULL)
        return 0;
    int is_slot = Py_IS_TYPE(descriptor, &PyMemberDescr_Type)
        && ((PyMemberDescrObject *)descriptor)->d_member->type == T_OBJECT_EX;
    if (is_slot)
        *slot = ((PyMemberDescrObject *)descriptor)->d_member->offset;
    else
        PyErr_Format(PyExc_TypeError, "%s.%s is no slot", type->tp_name, name);
    Py_DECREF(descriptor);
    return is_slot;
}

static PyObject *use(PyObject *module, PyObject *args)
{
    PyTypeObject *still, *moving;
    struct Slots found;
    int revision;
    if (!PyArg_ParseTuple(args, "O!O!i:use", &PyType_Type, &still, &PyType_Type, &moving,
                          &revision)
            || !find_slot(still, "pose", &found.pose)
            || !find_slot(moving, "stamps", &found.stamps)
            || !find_slot(moving, "poses", &found.poses)
            || !find_slot(moving, "parents", &found.parents)
            || !find_slot(moving, "_horizon", &found.horizon)
            || !find_slot(moving, "_is_linear", &found.is_linear))
        return NULL;
    if (revision != REVISION)
        return PyErr_Format(PyExc_TypeError, "revision %d, not %d", REVISION, revision);
    if (samples_type != NULL && samples_type != moving)
        return PyErr_Format(PyExc_TypeError, "other classes use it");
    slots = found;
    static_type = (PyTypeObject *)Py_NewRef(still);
    samples_type = (PyTypeObject *)Py_NewRef(moving);
    Py_RETURN_NONE;
}

static PyMethodDef functions[] = {
    {"pose_at", (PyCFunction)(void (*)(void))pose_at, METH_FASTCALL, NULL},
    {"use", use, METH_VARARGS, NULL},
    {NULL, NULL, 0, NULL}};

static struct PyModuleDef definition = {
    PyModuleDef_HEAD_INIT, "path_in_c", NULL, -1, functions, NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit_path_in_c(void)
{
    name_of_sample = PyUnicode_InternFromString("sample");
    return name_of_sample == NULL ? NULL : PyModule_Create(&definition);
}
