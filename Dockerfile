# vinesexp with every instrument format. From this folder:
#   docker build -t vinesexp --build-arg VERSION=0.1.0 .
#   docker run --rm -u "$(id -u):$(id -g)" -v "$PWD:/work" vinesexp run mytests
FROM python:3.12-slim

# .git is not copied (see .dockerignore): the version is given instead.
ARG VERSION=0.1.0
ENV SETUPTOOLS_SCM_PRETEND_VERSION=$VERSION

COPY . /source
RUN pip install --no-cache-dir -c /source/requirements.lock "/source[formats]" && rm -r /source

# Any user may run it: caches of compiled code and fonts go where everyone may write.
ENV HOME=/tmp NUMBA_CACHE_DIR=/tmp/numba MPLCONFIGDIR=/tmp/matplotlib XDG_CACHE_HOME=/tmp/cache
WORKDIR /work
ENTRYPOINT ["vinesexp"]
