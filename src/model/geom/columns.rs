//! Macros for tables of primitives that are a few numbers each: one column per field, one row per
//! primitive.

macro_rules! table {
    ($(#[$doc:meta])* $table:ident of $row:ident by $id:ident { $($field:ident: $ty:ty),* $(,)? }
        $(with $derived:ident: $of:ty = $make:expr)?) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Default)]
        pub struct $table {
            $(pub $field: Vec<$ty>,)*
            $($derived: Vec<$of>,)?
        }

        impl $table {
            pub fn push(&mut self, row: $row) -> $id {
                let id = $id(self.len() as u32);
                $(self.$derived.push($make(&row));)?
                $(self.$field.push(row.$field);)*
                id
            }

            #[inline(always)]
            pub fn row(&self, id: $id) -> $row {
                $row { $($field: self.$field[id.index()],)* }
            }

            pub fn rows(&self) -> impl Iterator<Item = ($id, $row)> + '_ {
                (0..self.len() as u32).map(|i| ($id(i), self.row($id(i))))
            }

            pub fn len(&self) -> usize {
                let columns = [$(self.$field.len()),*];
                columns[0]
            }

            pub fn is_empty(&self) -> bool {
                self.len() == 0
            }

            pub fn bytes(&self) -> usize {
                self.len() * (0 $(+ size_of::<$ty>())* $(+ size_of::<$of>())?)
            }
        }
    };
}

/// Defines the kernels of a [`Primitive`](super::primitive::Primitive) that is one span along a
/// ray: the span without bounds, and hit and ends with bounds.
macro_rules! kernels_of_span {
    (($self:ident, $id:ident: $Id:ty, $object:ident, $active:ident) $span:expr, $meet:expr, $ends:expr $(,)?) => {
        #[inline(always)]
        fn meet_fast<L: Lanes>(
            &$self,
            $id: $Id,
            $object: &ObjectRay<L>,
            _: L::Mask,
            _: &mut crate::geom::Scratch,
        ) -> Meet<L> {
            $span.first_beyond($object.ray.t_min)
        }

        #[inline(always)]
        fn meet<L: Lanes>(
            &$self,
            $id: $Id,
            _extent: f32,
            $object: &ObjectRay<L>,
            $active: L::Mask,
            _: &mut crate::geom::Scratch,
        ) -> Meet<L> {
            $meet
        }

        #[inline(always)]
        fn ends_fast<L: Lanes>(&$self, $id: $Id, $object: &ObjectRay<L>) -> Ends<L> {
            Ends::certain(&$span)
        }

        #[inline(always)]
        fn ends<L: Lanes>(&$self, $id: $Id, $object: &ObjectRay<L>, _: L::Double) -> Ends<L> {
            $ends
        }
    };
}

pub(super) use {kernels_of_span, table};
