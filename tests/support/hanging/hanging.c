/* A folder whose disk hangs: calls that write to it do not return until it goes on.

Loaded with LD_PRELOAD. Calls below the folder $HANGING_FOLDER wait for as long as the file $HANGING_CALLS names them: a
letter each, o (a file is made), w (written), d (a folder is made), r (a name is changed), u (a name is removed). Each call
that waits adds its letter to the file $HANGING_CALLS.waiting. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

static int is_named(char call)
{
    const char *file = getenv("HANGING_CALLS");
    char calls[16];
    int from = file == NULL ? -1 : syscall(SYS_openat, AT_FDCWD, file, O_RDONLY | O_CLOEXEC);
    if (from < 0)
        return 0;
    ssize_t size = read(from, calls, sizeof calls);
    close(from);
    return size > 0 && memchr(calls, call, size) != NULL;
}

/* Wait while calls of that kind hang below the folder; `path` may be relative to the open folder. */
static void pass(char call, int folder, const char *path)
{
    const char *hanging = getenv("HANGING_FOLDER");
    char link[64], whole[2 * PATH_MAX] = "", waiting[PATH_MAX];
    if (hanging == NULL || !is_named(call))
        return;
    if (path == NULL || *path != '/') {
        if (folder == AT_FDCWD)
            return;
        sprintf(link, "/proc/self/fd/%d", folder);
        ssize_t length = readlink(link, whole, PATH_MAX);
        if (length < 0)
            return;
        whole[length] = 0;
    } else
        snprintf(whole, sizeof whole, "%s", path);
    if (strncmp(whole, hanging, strlen(hanging)) != 0)
        return;
    snprintf(waiting, sizeof waiting, "%s.waiting", getenv("HANGING_CALLS"));
    int told = syscall(SYS_openat, AT_FDCWD, waiting, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    syscall(SYS_write, told, &call, 1);
    close(told);
    while (is_named(call))
        usleep(5000);
}

#define REAL(call) ((__typeof__(&call))dlsym(RTLD_NEXT, #call))

ssize_t write(int file, const void *data, size_t size)
{
    pass('w', file, NULL);
    return syscall(SYS_write, file, data, size);
}

int mkdir(const char *path, mode_t mode)
{
    pass('d', AT_FDCWD, path);
    return REAL(mkdir)(path, mode);
}

int rename(const char *from, const char *to)
{
    pass('r', AT_FDCWD, to);
    return REAL(rename)(from, to);
}

int unlink(const char *path)
{
    pass('u', AT_FDCWD, path);
    return REAL(unlink)(path);
}

int rmdir(const char *path)
{
    pass('u', AT_FDCWD, path);
    return REAL(rmdir)(path);
}

int unlinkat(int folder, const char *path, int flags)
{
    pass('u', folder, path);
    return REAL(unlinkat)(folder, path, flags);
}

static int opened(int folder, const char *path, int flags, mode_t mode)
{
    if (flags & O_CREAT)
        pass('o', folder, path);
    return syscall(SYS_openat, folder, path, flags, mode);
}

#define MODE(after)          \
    va_list given;           \
    va_start(given, after);  \
    mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(given, mode_t) : 0; \
    va_end(given);

int open(const char *path, int flags, ...)
{
    MODE(flags)
    return opened(AT_FDCWD, path, flags, mode);
}

int open64(const char *path, int flags, ...)
{
    MODE(flags)
    return opened(AT_FDCWD, path, flags, mode);
}

int openat(int folder, const char *path, int flags, ...)
{
    MODE(flags)
    return opened(folder, path, flags, mode);
}

int openat64(int folder, const char *path, int flags, ...)
{
    MODE(flags)
    return opened(folder, path, flags, mode);
}
